//! The embedded body: a parametric human figure of 13,000 vertices with ten directions of shape.
//!
//! `tryon-bench make-body` makes its file; a test there makes it again and compares.

use super::Template;
use std::sync::{Arc, OnceLock};

/// Names of the directions, in order; `sex` +1 is the mean man, −1 the mean woman.
pub const DIRECTIONS: [&str; 10] = [
    "stature",
    "girth",
    "sex",
    "limb_length",
    "torso_length",
    "shoulder_width",
    "chest",
    "waist",
    "hip",
    "belly",
];

/// Largest sound coefficient, standard deviations: spans 98.8 % of a normally distributed population.
pub const RANGE: f64 = 2.5;

/// See [`Template::to_bytes`].
static FILE: &[u8] = include_bytes!("embedded.bin");

/// The embedded body, read on first use and shared.
///
/// # Panics
/// Never in a build that passes its tests: the file is part of the program.
pub fn template() -> Arc<Template> {
    static TEMPLATE: OnceLock<Arc<Template>> = OnceLock::new();
    #[expect(
        clippy::expect_used,
        reason = "the file is part of the program; a test reads it"
    )]
    TEMPLATE
        .get_or_init(|| Arc::new(Template::from_bytes(FILE).expect("the embedded body fits")))
        .clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_holds_a_body_with_all_directions_and_gives_the_same_bytes() {
        let read = Template::from_bytes(FILE).expect("readable");
        let space = read.shape_space().expect("shape space");
        assert_eq!(space.names, DIRECTIONS);
        assert!((12_000..=14_000).contains(&read.mesh().vertices().len()));
        assert_eq!(read.to_bytes(), FILE);
    }

    #[test]
    fn a_file_that_is_cut_or_changed_is_refused() {
        assert!(Template::from_bytes(&FILE[..FILE.len() / 2]).is_err());
        assert!(Template::from_bytes(&[]).is_err());
        assert!(Template::from_bytes(b"not deflated").is_err());
    }
}
