//! Run time against error as an SVG picture: the lower left corner is where one wants to be.

use super::{EvaluateError, Table};
use plotters::prelude::*;
use std::ops::Range;

/// Size of a plot, pixels.
const SIZE: (u32, u32) = (860, 520);
/// Axes go this far beyond the smallest and largest value.
const MARGIN: f64 = 1.25;
/// Smallest value that a logarithmic axis shows; zeros are drawn here.
const LEAST: f64 = 1e-3;

/// Draws run time (milliseconds, logarithmic) against one error (logarithmic); rows of one scene and method are joined
/// in their order. `None` without a finite value.
///
/// # Errors
/// [`EvaluateError::Plot`] when the drawing library refuses.
pub fn run_time_against_error(table: &Table, error: &str) -> Result<Option<String>, EvaluateError> {
    let mut series: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    for row in &table.rows {
        let Some(value) = row
            .get(error)
            .filter(|v| v.is_finite() && row.run_ms.is_finite())
        else {
            continue;
        };
        let name = format!("{} · {}", row.scene, row.method);
        let at = series
            .iter()
            .position(|(n, _)| *n == name)
            .unwrap_or_else(|| {
                series.push((name, Vec::new()));
                series.len() - 1
            });
        series[at].1.push((row.run_ms.max(LEAST), value.max(LEAST)));
    }
    let all: Vec<(f64, f64)> = series.iter().flat_map(|(_, p)| p.iter().copied()).collect();
    if all.is_empty() {
        return Ok(None);
    }
    let span = |f: fn(&(f64, f64)) -> f64| {
        let lo = all.iter().map(f).fold(f64::INFINITY, f64::min) / MARGIN;
        let hi = all.iter().map(f).fold(0.0, f64::max) * MARGIN;
        lo..hi
    };
    let mut svg = String::new();
    let axes = [span(|p| p.0), span(|p| p.1)];
    draw(&mut svg, table, error, &series, axes).map_err(|e| EvaluateError::Plot {
        error: error.to_owned(),
        why: e.to_string(),
    })?;
    Ok(Some(svg))
}

/// Draws the series over the `axes`, x then y.
fn draw(
    svg: &mut String,
    table: &Table,
    error: &str,
    series: &[(String, Vec<(f64, f64)>)],
    [x, y]: [Range<f64>; 2],
) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(format!("{}: {error}", table.name), ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(x.log_scale(), y.log_scale())?;
    let tick = |v: &f64| {
        if *v >= 10.0 {
            format!("{v:.0}")
        } else {
            format!("{v:.2}")
        }
    };
    chart
        .configure_mesh()
        .x_desc(format!("run time, ms ({})", table.run_time))
        .y_desc(error)
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .light_line_style(BLACK.mix(0.06))
        .draw()?;
    for (i, (name, points)) in series.iter().enumerate() {
        let color = Palette99::pick(i).to_rgba();
        chart
            .draw_series(LineSeries::new(
                points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        chart.draw_series(points.iter().map(|p| Circle::new(*p, 3, color.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    root.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::Row;
    use super::*;

    #[test]
    fn a_plot_names_its_methods_and_survives_zeros_and_nan() {
        let mut t = Table::new("trial", "", "one frame");
        assert!(
            run_time_against_error(&t, "mm")
                .expect("no fault")
                .is_none()
        );
        for (ms, mm) in [(1.0, 0.0), (2.0, 5.0), (4.0, f64::NAN), (8.0, 4.0)] {
            t.rows.push(Row::new("walk", "kd-tree", ms).error("mm", mm));
        }
        let svg = run_time_against_error(&t, "mm")
            .expect("draws")
            .expect("three values");
        assert!(
            svg.starts_with("<svg") && svg.contains("walk · kd-tree") && svg.contains("one frame")
        );
        assert_eq!(svg.matches("<circle").count(), 3);
        assert!(
            run_time_against_error(&t, "other")
                .expect("no fault")
                .is_none()
        );
    }
}
