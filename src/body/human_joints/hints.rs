//! Hints of a joint's name: side and segment, in the words of common rigs.

use crate::parts::BodySide;

/// Joint of a limb or of the head that a name hints at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JointHint {
    Collar,
    Shoulder,
    Elbow,
    Wrist,
    Hip,
    Knee,
    Ankle,
    Toe,
    Neck,
    Head,
    /// A part of a segment that only twists.
    Twist,
}

/// Last words of a joint's name without its side (SMPL, CMU, Mixamo, Biped, Unreal, VRM, Rokoko, Rigify, MakeHuman).
/// `shoulder` is a collar in half of them and hints at nothing.
const WORDS: [(&str, JointHint); 42] = [
    ("clavicle", JointHint::Collar),
    ("collar", JointHint::Collar),
    ("collarbone", JointHint::Collar),
    ("upperarm", JointHint::Shoulder),
    ("uparm", JointHint::Shoulder),
    ("humerus", JointHint::Shoulder),
    ("shldr", JointHint::Shoulder),
    ("arm", JointHint::Shoulder),
    ("elbow", JointHint::Elbow),
    ("forearm", JointHint::Elbow),
    ("lowerarm", JointHint::Elbow),
    ("lowarm", JointHint::Elbow),
    ("radius", JointHint::Elbow),
    ("wrist", JointHint::Wrist),
    ("hand", JointHint::Wrist),
    ("hip", JointHint::Hip),
    ("thigh", JointHint::Hip),
    ("upleg", JointHint::Hip),
    ("upperleg", JointHint::Hip),
    ("femur", JointHint::Hip),
    ("knee", JointHint::Knee),
    ("shin", JointHint::Knee),
    ("calf", JointHint::Knee),
    ("leg", JointHint::Knee),
    ("lowerleg", JointHint::Knee),
    ("lowleg", JointHint::Knee),
    ("tibia", JointHint::Knee),
    ("crus", JointHint::Knee),
    ("ankle", JointHint::Ankle),
    ("foot", JointHint::Ankle),
    ("toe", JointHint::Toe),
    ("toes", JointHint::Toe),
    ("toebase", JointHint::Toe),
    ("ball", JointHint::Toe),
    ("neck", JointHint::Neck),
    ("lowerneck", JointHint::Neck),
    ("head", JointHint::Head),
    ("twist", JointHint::Twist),
    ("roll", JointHint::Twist),
    ("pelvis", JointHint::Twist),
    ("buttock", JointHint::Twist),
    ("hipjoint", JointHint::Twist),
];

/// Words of a name in lower case: split at marks, at digits, and where the case rises.
fn words(name: &str) -> Vec<String> {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    let letters: Vec<char> = name.chars().collect();
    let mut out: Vec<String> = Vec::new();
    let mut is_open = false;
    for (i, c) in letters.iter().enumerate() {
        if !c.is_alphabetic() {
            is_open = false;
            continue;
        }
        let before = i.checked_sub(1).map(|k| letters[k]);
        let after = letters.get(i + 1);
        let rises = c.is_uppercase()
            && (before.is_some_and(char::is_lowercase) || after.is_some_and(|a| a.is_lowercase()));
        if !is_open || rises {
            out.push(String::new());
        }
        is_open = true;
        if let Some(word) = out.last_mut() {
            word.extend(c.to_lowercase());
        }
    }
    out
}

/// Side of a whole word.
fn side_word(word: &str) -> Option<BodySide> {
    match word {
        "left" | "l" | "lft" | "lt" => Some(BodySide::Left),
        "right" | "r" | "rgt" | "rt" => Some(BodySide::Right),
        _ => None,
    }
}

/// Side and rest of a word that begins with its side, such as `lfemur` or `leftupleg`.
fn side_prefix(word: &str) -> Option<(BodySide, &str)> {
    let sides = [
        ("left", BodySide::Left),
        ("right", BodySide::Right),
        ("l", BodySide::Left),
        ("r", BodySide::Right),
    ];
    let known = |rest: &str| {
        WORDS.iter().any(|(w, _)| *w == rest) || ["thumb", "fingers", "shoulder"].contains(&rest)
    };
    sides.into_iter().find_map(|(prefix, side)| {
        let rest = word.strip_prefix(prefix)?;
        known(rest).then_some((side, rest))
    })
}

/// Side that a name states.
pub(super) fn side(name: &str) -> Option<BodySide> {
    let words = words(name);
    let whole = words.iter().find_map(|w| side_word(w));
    whole.or_else(|| words.iter().find_map(|w| side_prefix(w).map(|s| s.0)))
}

/// Joint that a name hints at.
pub(super) fn joint(name: &str) -> Option<JointHint> {
    let bare = |word: String| match side_prefix(&word) {
        Some((_, rest)) => rest.to_owned(),
        None => word,
    };
    let words: Vec<String> = words(name)
        .into_iter()
        .filter(|w| side_word(w).is_none())
        .map(bare)
        .collect();
    if words.iter().any(|w| w == "twist" || w == "roll") {
        return Some(JointHint::Twist);
    }
    // The two last words name one thing (`Up Leg`), or the last alone does.
    let last = words.last()?;
    let pair = words
        .len()
        .checked_sub(2)
        .map(|k| format!("{}{last}", words[k]));
    let find = |text: &str| WORDS.iter().find(|(w, _)| *w == text).map(|w| w.1);
    pair.and_then(|p| find(&p)).or_else(|| find(last))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_common_rigs_give_side_and_joint() {
        use JointHint::*;
        let l = Some(BodySide::Left);
        let r = Some(BodySide::Right);
        for (name, hinted, on) in [
            ("mixamorig:LeftUpLeg", Some(Hip), l),
            ("mixamorig:LeftForeArm", Some(Elbow), l),
            ("Bip01 L Thigh", Some(Hip), l),
            ("Bip01 R Calf", Some(Knee), r),
            ("Bip001 L UpperArm", Some(Shoulder), l),
            ("lfemur", Some(Hip), l),
            ("rtibia", Some(Knee), r),
            ("lhumerus", Some(Shoulder), l),
            ("lShldr", Some(Shoulder), l),
            ("thigh.L", Some(Hip), l),
            ("DEF-forearm.R", Some(Elbow), r),
            ("thigh_l", Some(Hip), l),
            ("lowerarm_r", Some(Elbow), r),
            ("J_Bip_L_UpperLeg", Some(Hip), l),
            ("LeftShin", Some(Knee), l),
            ("upperleg01.L", Some(Hip), l),
            ("left_wrist", Some(Wrist), l),
            ("leftUpperArm", Some(Shoulder), l),
            ("LHipJoint", Some(Twist), l),
            ("LeftForeArmRoll", Some(Twist), l),
            ("LeftHandMiddle1", None, l),
            ("Spine1", None, None),
            ("rclavicle", Some(Collar), r),
            ("lToeBase", Some(Toe), l),
            ("Neck", Some(Neck), None),
            ("root", None, None),
            ("LeftArm", Some(Shoulder), l),
            ("RightLeg", Some(Knee), r),
        ] {
            assert_eq!((joint(name), side(name)), (hinted, on), "{name}");
        }
    }
}
