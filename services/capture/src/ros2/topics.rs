//! Topics of a camera, as configured.

/// Topic of depth, and that of colour if there is one. Names begin with a slash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Topics {
    pub(super) depth: String,
    pub(super) color: Option<String>,
}

impl Topics {
    /// Topics of `DEPTH` or `DEPTH,COLOR`.
    ///
    /// # Errors
    /// Names the topic that is no name of ROS, or says that there are none or too many.
    pub(crate) fn parse(list: &str) -> Result<Self, String> {
        let names = list.split(',').map(|t| topic(t.trim()));
        let names = names.collect::<Result<Vec<_>, _>>()?;
        match &names[..] {
            [depth] => Ok(Self {
                depth: depth.clone(),
                color: None,
            }),
            [depth, color] if color != depth => Ok(Self {
                depth: depth.clone(),
                color: Some(color.clone()),
            }),
            _ => Err("one topic of depth, or another one of colour after a comma".into()),
        }
    }
}

/// A topic with its leading slash.
fn topic(name: &str) -> Result<String, String> {
    let path = name.strip_prefix('/').unwrap_or(name);
    let is_word = |w: &str| {
        !w.is_empty()
            && !w.starts_with(|c: char| c.is_ascii_digit())
            && w.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    if path.split('/').all(is_word) {
        return Ok(format!("/{path}"));
    }
    Err(format!(
        "`{name}` is no topic, such as /camera/depth/image_rect_raw"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_names_of_ros() {
        let both = Topics::parse("/cam/depth/image_raw, cam/color/image_raw/compressed");
        let both = both.expect("two");
        assert_eq!(both.depth, "/cam/depth/image_raw");
        assert_eq!(
            both.color.as_deref(),
            Some("/cam/color/image_raw/compressed")
        );
        assert_eq!(Topics::parse("/d").expect("one").color, None);
        for bad in [
            "", "/", "/a//b", "/a/", "/a/**", "/a/$*", "/a?b", "/a#b", "/a/0b", "/a b", "/a/@b",
            "/a%b", "/ä", ",/a", "/a,", "/a,/a", "/a,/b,/c",
        ] {
            assert!(Topics::parse(bad).is_err(), "{bad}");
        }
    }
}
