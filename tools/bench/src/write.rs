//! Files of a table: CSV, JSON and one SVG plot per measure of error.

use super::plot::run_time_against_error;
use super::{EvaluateError, Table};
use std::path::{Path, PathBuf};

impl Table {
    /// Writes `NAME.csv`, `NAME.json` and, for each error with a finite value, `NAME-ERROR.svg` into `dir`, which is made when missing. Returns the files.
    ///
    /// # Errors
    /// Names the file that cannot be written or the plot that cannot be drawn.
    pub fn write(&self, dir: &Path) -> Result<Vec<PathBuf>, EvaluateError> {
        let file = |path: &Path| {
            let path = path.to_owned();
            move |source| EvaluateError::File { path, source }
        };
        std::fs::create_dir_all(dir).map_err(file(dir))?;
        let mut written = Vec::new();
        let mut save = |name: String, text: String| {
            let path = dir.join(name);
            std::fs::write(&path, text).map_err(file(&path))?;
            written.push(path);
            Ok::<(), EvaluateError>(())
        };
        save(format!("{}.csv", self.name), self.to_csv())?;
        save(
            format!("{}.json", self.name),
            format!("{:#}\n", self.to_json()),
        )?;
        for error in self.errors() {
            if let Some(svg) = run_time_against_error(self, error)? {
                save(format!("{}-{error}.svg", self.name), svg)?;
            }
        }
        Ok(written)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Row;
    use super::*;

    fn table() -> Table {
        let mut t = Table::new("trial", "tryon-bench trial", "one step");
        t.rows
            .push(Row::new("walk", "plane", 1.5).error("joints_mm", 9.0));
        t.rows.push(
            Row::new("walk", "plane", 3.0)
                .error("joints_mm", 5.0)
                .error("lost", 2.0)
                .error("absent", f64::NAN),
        );
        t
    }

    #[test]
    fn files_are_written_and_a_bad_folder_is_named() {
        let dir = tempfile::tempdir().expect("folder");
        let files = table().write(&dir.path().join("new")).expect("written");
        assert_eq!(
            files.len(),
            4,
            "{files:?}: `lost` has one value, `absent` none"
        );
        let blocked = dir.path().join("file");
        std::fs::write(&blocked, "x").expect("file");
        let error = table()
            .write(&blocked)
            .expect_err("a file is no folder")
            .to_string();
        assert!(error.contains("file"), "{error}");
        assert_eq!(
            Table::default().to_csv().lines().count(),
            1,
            "an empty table has a head only"
        );
    }
}
