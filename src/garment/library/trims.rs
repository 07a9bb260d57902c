//! Trims of the library's garments: pockets, plackets with buttons, flies, zips, cords.

use crate::{Panel, Trim, TrimKind};
use std::f64::consts::FRAC_PI_2;

/// Diameter of a shirt's and of a waistband's button, metres.
const SHIRT_BUTTON: f64 = 0.0115;
const WAIST_BUTTON: f64 = 0.017;
/// Distance of two buttons of a placket, metres.
const BUTTON_STEP: f64 = 0.05;

/// Trims of a garment by its name; none for others.
pub(super) fn of(name: &str, panels: &[Panel]) -> Vec<Trim> {
    let mut set = TrimSet {
        panels,
        trims: Vec::new(),
    };
    match name {
        "longsleeve" => {
            set.placket("front", 3);
            set.add(
                "front",
                TrimKind::PatchPocket,
                [0.085, -0.20],
                [0.105, 0.12],
            );
        }
        "hoodie" => set.hoodie(),
        "dress" => {
            set.placket("front", 4);
            for x in [-0.15, 0.15] {
                set.add(
                    "skirt_front",
                    TrimKind::PatchPocket,
                    [x, -0.15],
                    [0.13, 0.15],
                );
            }
        }
        "skirt" => set.add("back", TrimKind::Zip, [0.0, -0.12], [0.024, 0.18]),
        "straight_skirt" => set.straight_skirt(),
        "trousers" => {
            set.trousers_front();
            for (panel, side) in [("back_right", 1.0), ("back_left", -1.0)] {
                set.add(
                    panel,
                    TrimKind::PatchPocket,
                    [side * 0.115, -0.15],
                    [0.14, 0.155],
                );
                for x in [0.03, 0.15] {
                    set.add(panel, TrimKind::Loop, [side * x, -0.022], [0.010, 0.044]);
                }
            }
        }
        "shorts" => {
            set.trousers_front();
            for (panel, side) in [("back_right", 1.0), ("back_left", -1.0)] {
                set.add(panel, TrimKind::Slit, [side * 0.115, -0.10], [0.13, 0.014]);
                set.button(panel, [side * 0.115, -0.122], SHIRT_BUTTON);
            }
        }
        _ => {}
    }
    set.trims
}

struct TrimSet<'a> {
    panels: &'a [Panel],
    trims: Vec<Trim>,
}

impl TrimSet<'_> {
    fn turned(&mut self, panel: &str, kind: TrimKind, at: [f64; 2], size: [f64; 2], turn: f64) {
        self.trims.push(Trim {
            panel: panel.into(),
            kind,
            at,
            size,
            turn,
        });
    }

    fn add(&mut self, panel: &str, kind: TrimKind, at: [f64; 2], size: [f64; 2]) {
        self.turned(panel, kind, at, size, 0.0);
    }

    fn button(&mut self, panel: &str, at: [f64; 2], diameter: f64) {
        self.add(panel, TrimKind::Button, at, [diameter; 2]);
    }

    /// Lowest point of a neckline, or of a hem, at the middle of a panel; 0 without that edge.
    fn height_of(&self, panel: &str, edge: &str) -> f64 {
        let panel = self.panels.iter().find(|p| p.name == panel);
        let height = |p: &Panel| Some(p.edges[p.edge(edge)?].from[1]);
        panel.and_then(height).unwrap_or(0.0)
    }

    /// Placket below a neckline with that many buttons.
    fn placket(&mut self, panel: &str, buttons: u8) {
        let top = self.height_of(panel, "neck_left");
        let length = BUTTON_STEP * f64::from(buttons);
        self.add(
            panel,
            TrimKind::Placket,
            [0.0, top - 0.5 * length],
            [0.03, length],
        );
        for k in 0..buttons {
            let y = top - 0.02 - BUTTON_STEP * f64::from(k);
            self.button(panel, [0.0, y], SHIRT_BUTTON);
        }
    }

    fn hoodie(&mut self) {
        let (top, hem) = (
            self.height_of("front", "neck_left"),
            self.height_of("front", "hem"),
        );
        self.add("front", TrimKind::Pouch, [0.0, hem + 0.17], [0.34, 0.20]);
        for x in [-0.035, 0.035] {
            self.add("front", TrimKind::Cord, [x, top - 0.10], [0.008, 0.19]);
        }
    }

    fn straight_skirt(&mut self) {
        let hem = self.height_of("back", "hem");
        self.add("back", TrimKind::Zip, [0.0, -0.10], [0.024, 0.18]);
        self.turned(
            "back",
            TrimKind::Slit,
            [0.0, hem + 0.09],
            [0.18, 0.012],
            FRAC_PI_2,
        );
    }

    /// Side pockets, fly, button and loops of the waistband.
    fn trousers_front(&mut self) {
        for (panel, side) in [("front_left", 1.0), ("front_right", -1.0)] {
            let waist = self.waist_of(panel);
            let (above, below) = ([0.62 * waist, -0.045], [1.02 * waist, -0.175]);
            let across = [below[0] - above[0], below[1] - above[1]];
            let middle = [0, 1].map(|k| 0.5 * (above[k] + below[k]));
            let turn = side * across[1].atan2(across[0]);
            let length = across[0].hypot(across[1]);
            self.turned(
                panel,
                TrimKind::Slit,
                [side * middle[0], middle[1]],
                [length, 0.02],
                turn,
            );
            self.add(
                panel,
                TrimKind::Loop,
                [side * 0.55 * waist, -0.022],
                [0.010, 0.044],
            );
        }
        self.add("front_left", TrimKind::Fly, [0.019, -0.125], [0.038, 0.16]);
        self.button("front_left", [0.012, -0.022], WAIST_BUTTON);
    }

    /// Width of a trouser panel at its waist.
    fn waist_of(&self, panel: &str) -> f64 {
        let panel = self.panels.iter().find(|p| p.name == panel);
        let outer = |p: &Panel| {
            let xs = p.edges.iter().filter(|e| e.from[1] == 0.0);
            xs.map(|e| e.from[0].abs()).fold(0.0, f64::max)
        };
        panel.map_or(0.0, outer)
    }
}
