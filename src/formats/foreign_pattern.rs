//! Pattern files of programs whose patterns are not read: told by their content, refused with the way around.

use super::FormatError;
use serde_json::Value;
use std::path::Path;

/// Endings of pattern files that are not JSON.
const ENDINGS: [&str; 9] = [
    "dxf", "val", "vit", "sm2d", "zprj", "zpac", "pds", "mdl", "svg",
];

/// Way around for cut pieces: what holds the seams and the shape on a body.
const SEW_FIRST: &str = "it holds cut pieces without seams or their places on a body; sew it in a garment program (CLO3D, \
     Marvelous Designer, Style3D, Blender) and export the sewn garment as OBJ or glTF, or draft it with GarmentCode (JSON)";

/// True for the name of a pattern file of another program that is not JSON.
pub fn is_foreign_pattern(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str());
    ending.is_some_and(|e| ENDINGS.contains(&e.to_ascii_lowercase().as_str()))
}

/// Refuses a pattern file of a program that is known and not read. Text that is none passes.
///
/// # Errors
/// The program or format, and the way around.
pub fn refuse_foreign_pattern(bytes: &[u8], path: &Path) -> Result<(), FormatError> {
    let refused = |what: &str, why: &str| Err(FormatError::field(path, what, why));
    let text = String::from_utf8_lossy(bytes);
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if start.starts_with('{') {
        return match json_kind(start) {
            Some("measurements") => refused(
                "FreeSewing measurements",
                "it holds a body's measures and no pattern; give a garment drafted for them",
            ),
            Some(kind) => refused(kind, SEW_FIRST),
            None => Ok(()),
        };
    }
    let head: String = start.chars().take(4_000).collect();
    if head.starts_with('<') {
        return match xml_kind(&head) {
            Some(kind) => refused(kind, SEW_FIRST),
            None => refused(
                "XML",
                "it is no pattern that is known; GarmentCode's JSON is read",
            ),
        };
    }
    let mut lines = head.lines().map(str::trim);
    if lines.next() == Some("0") && lines.next() == Some("SECTION") {
        return refused("DXF (AAMA, ASTM)", SEW_FIRST);
    }
    if bytes.starts_with(b"AutoCAD Binary DXF") {
        return refused("binary DXF", SEW_FIRST);
    }
    if is_foreign_pattern(path) {
        return refused("pattern", SEW_FIRST);
    }
    Ok(())
}

/// Kind of a JSON text of FreeSewing: parts or stacks of a drafted design, or a set of measurements.
fn json_kind(text: &str) -> Option<&'static str> {
    let value: Value = serde_json::from_str(text).ok()?;
    let has = |key: &str| {
        value
            .get(key)
            .is_some_and(|v| v.is_object() || v.is_array())
    };
    if value.get("pattern").is_some() || has("panels") {
        None
    } else if has("parts") || has("stacks") {
        Some("FreeSewing design")
    } else if value.get("design").is_some() && has("settings") {
        Some("FreeSewing settings")
    } else if has("measurements") {
        Some("measurements")
    } else {
        None
    }
}

fn xml_kind(head: &str) -> Option<&'static str> {
    let has = |mark: &str| head.contains(mark);
    if has("Seamly2D") || has("seamly") || has("Seamly") {
        Some("Seamly2D pattern")
    } else if has("Valentina") || (has("<pattern") && has("<draw ")) {
        Some("Valentina or Seamly2D pattern")
    } else if has("<svg") {
        Some("SVG")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str, name: &str) -> String {
        let e = refuse_foreign_pattern(text.as_bytes(), Path::new(name));
        e.map_or_else(|e| e.to_string(), |()| "read".to_owned())
    }

    #[test]
    fn patterns_of_other_programs_are_refused_by_kind_with_the_way_around() {
        let dxf = "  0\r\nSECTION\r\n  2\r\nBLOCKS\r\n";
        let seamly = "<?xml version=\"1.0\"?>\n<pattern>\n<!--Pattern created with Seamly2D v0.6.0.1-->\n<draw name=\"a\">";
        let valentina = "\u{feff}<?xml version='1.0'?><pattern><unit>cm</unit><draw name=\"a\"></draw></pattern>";
        let design =
            r#"{"settings":[{}],"stacks":{"aaron.front":{}},"parts":[{}],"design":"aaron"}"#;
        for (text, name, kind) in [
            (dxf, "shirt.dxf", "DXF"),
            (seamly, "shirt.sm2d", "Seamly2D"),
            (valentina, "shirt.val", "Valentina"),
            (design, "aaron.json", "FreeSewing design"),
            ("<svg xmlns='http://www.w3.org/2000/svg'/>", "a.svg", "SVG"),
            ("PK\u{3}\u{4}", "a.zprj", "pattern"),
        ] {
            let e = refused(text, name);
            assert!(
                e.contains(kind)
                    && e.contains(name)
                    && e.contains("export the sewn garment as OBJ"),
                "{e}"
            );
        }
        let e = refused(r#"{"measurements":{"chest":1000}}"#, "me.json");
        assert!(e.contains("measures and no pattern"), "{e}");
        for text in [
            r#"{"pattern":{"stitches":[]}}"#,
            r#"{"name":"a","panels":[]}"#,
            "{",
            "",
        ] {
            assert_eq!(refused(text, "a.json"), "read", "{text}");
        }
    }
}
