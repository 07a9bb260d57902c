//! Results of a benchmark: one row for each method, parameters and scene.

use serde::Serialize;
use serde_json::{Map, Value, json};

/// One measurement.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// Sequence or scene measured on.
    pub scene: String,
    /// Method measured; rows of one method in one scene are joined in the plot.
    pub method: String,
    /// Settings, in the order in which they are shown.
    pub parameters: Vec<(String, String)>,
    /// Run time of one unit of work (a frame, a step), milliseconds; the unit is named by [`Table::run_time`].
    pub run_ms: f64,
    /// Errors by name with unit, for example `("joints_mm", 8.5)`.
    pub errors: Vec<(String, f64)>,
}

impl Row {
    /// A row without parameters and errors.
    pub fn new(scene: impl Into<String>, method: impl Into<String>, run_ms: f64) -> Self {
        Self {
            scene: scene.into(),
            method: method.into(),
            run_ms,
            ..Self::default()
        }
    }
    /// Adds a parameter.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.parameters.push((name.to_owned(), value.to_string()));
        self
    }
    /// Adds an error.
    #[must_use]
    pub fn error(mut self, name: &str, value: f64) -> Self {
        self.errors.push((name.to_owned(), value));
        self
    }
    /// Error of that name, if measured.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.errors.iter().find(|(n, _)| n == name).map(|(_, v)| *v)
    }
}

/// Results of one benchmark.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// File name without extension, and title.
    pub name: String,
    /// Command that reproduces it.
    pub command: String,
    /// Unit of work that [`Row::run_ms`] counts.
    pub run_time: String,
    /// The measurements.
    pub rows: Vec<Row>,
}

/// Names of the pairs of all rows, each once, in the order of their first use.
fn names<'a>(pairs: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut out: Vec<&str> = Vec::new();
    for name in pairs {
        if !out.contains(&name) {
            out.push(name);
        }
    }
    out
}

/// A field of a CSV file (RFC 4180).
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

impl Table {
    /// An empty table.
    pub fn new(
        name: impl Into<String>,
        command: impl Into<String>,
        run_time: impl Into<String>,
    ) -> Self {
        Self {
            name: name.into(),
            command: command.into(),
            run_time: run_time.into(),
            rows: Vec::new(),
        }
    }
    /// Names of all errors, in the order of their first use.
    pub fn errors(&self) -> Vec<&str> {
        names(
            self.rows
                .iter()
                .flat_map(|r| r.errors.iter().map(|(n, _)| n.as_str())),
        )
    }
    fn parameters(&self) -> Vec<&str> {
        names(
            self.rows
                .iter()
                .flat_map(|r| r.parameters.iter().map(|(n, _)| n.as_str())),
        )
    }
    /// Comma-separated values: scene, method, parameters, `run_ms`, errors; missing values are empty.
    pub fn to_csv(&self) -> String {
        let (parameters, errors) = (self.parameters(), self.errors());
        let mut out = String::from("scene,method");
        for p in parameters
            .iter()
            .copied()
            .chain(["run_ms"])
            .chain(errors.iter().copied())
        {
            out.push(',');
            out += &field(p);
        }
        out.push('\n');
        for row in &self.rows {
            out += &field(&row.scene);
            out.push(',');
            out += &field(&row.method);
            for p in &parameters {
                out.push(',');
                out += &row
                    .parameters
                    .iter()
                    .find(|(n, _)| n == p)
                    .map_or(String::new(), |(_, v)| field(v));
            }
            out += &format!(",{:.4}", row.run_ms);
            for e in &errors {
                out.push(',');
                out += &row.get(e).map_or(String::new(), |v| format!("{v:.4}"));
            }
            out.push('\n');
        }
        out
    }
    /// Table as JSON; numbers that are not finite become null.
    pub fn to_json(&self) -> Value {
        let row = |r: &Row| {
            let text = |(n, v): &(String, String)| (n.clone(), Value::from(v.as_str()));
            let number = |(n, v): &(String, f64)| (n.clone(), Value::from(*v));
            json!({
                "scene": r.scene,
                "method": r.method,
                "parameters": r.parameters.iter().map(text).collect::<Map<_, _>>(),
                "run_ms": r.run_ms,
                "errors": r.errors.iter().map(number).collect::<Map<_, _>>(),
            })
        };
        json!({
            "name": self.name,
            "command": self.command,
            "run_time": self.run_time,
            "rows": self.rows.iter().map(row).collect::<Vec<_>>(),
        })
    }
    /// Rows as aligned text for a terminal or a Markdown page.
    pub fn to_markdown(&self) -> String {
        let (parameters, errors) = (self.parameters(), self.errors());
        let mut head = vec!["scene", "method"];
        head.extend(parameters.iter().chain(&["run_ms"]).chain(&errors));
        let mut out = format!("| {} |\n|{}\n", head.join(" | "), "---|".repeat(head.len()));
        for r in &self.rows {
            let mut cells = vec![r.scene.clone(), r.method.clone()];
            let value = |p: &&str| {
                r.parameters
                    .iter()
                    .find(|(n, _)| n == p)
                    .map_or(String::new(), |(_, v)| v.clone())
            };
            cells.extend(parameters.iter().map(value));
            cells.push(format!("{:.2}", r.run_ms));
            cells.extend(
                errors
                    .iter()
                    .map(|e| r.get(e).map_or(String::new(), |v| format!("{v:.2}"))),
            );
            out += &format!("| {} |\n", cells.join(" | "));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let mut t = Table::new("trial", "tryon-bench trial", "one step");
        t.rows.push(
            Row::new("walk, fast", "plane", 1.5)
                .with("iterations", 2)
                .error("joints_mm", 9.0),
        );
        t.rows.push(
            Row::new("walk, fast", "plane", 3.0)
                .with("iterations", 8)
                .error("joints_mm", 5.0),
        );
        t.rows.push(
            Row::new("walk, fast", "said \"point\"", 4.0)
                .error("joints_mm", f64::NAN)
                .error("lost", 2.0),
        );
        t
    }

    #[test]
    fn csv_quotes_and_leaves_gaps() {
        let csv = table().to_csv();
        let lines: Vec<&str> = csv.lines().collect();
        assert_eq!(lines[0], "scene,method,iterations,run_ms,joints_mm,lost");
        assert_eq!(lines[1], "\"walk, fast\",plane,2,1.5000,9.0000,");
        assert_eq!(
            lines[3],
            "\"walk, fast\",\"said \"\"point\"\"\",,4.0000,NaN,2.0000"
        );
    }

    #[test]
    fn json_keeps_every_row_and_markdown_every_column() {
        let v = table().to_json();
        assert_eq!(v["rows"][1]["errors"]["joints_mm"], 5.0);
        assert!(v["rows"][2]["errors"]["joints_mm"].is_null());
        assert!(
            table()
                .to_markdown()
                .lines()
                .all(|l| l.matches('|').count() == 7)
        );
    }
}
