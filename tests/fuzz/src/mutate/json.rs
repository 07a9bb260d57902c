//! Mutations of JSON trees.

use super::Mutator;
use super::text::NUMBERS;
use rand::Rng;
use rand::seq::IndexedRandom;
use serde_json::{Map, Number, Value};

/// Depth of nesting that parsers must refuse or hold.
const DEEP: usize = 200;

impl Mutator<'_> {
    pub(super) fn json(&mut self, b: &mut Vec<u8>, donor: &[u8]) {
        let parsed = serde_json::from_slice::<Value>(b);
        let Ok(mut tree) = parsed else {
            return self.text(b, donor);
        };
        if self.rng.random_bool(0.1) {
            return self.text(b, donor);
        }
        let count = nodes(&tree);
        let chosen = self.rng.random_range(0..count);
        if let Some(node) = nth(&mut tree, &mut { chosen }) {
            self.node(node);
        }
        *b = tree.to_string().into_bytes();
    }

    fn node(&mut self, node: &mut Value) {
        match node {
            Value::Array(list) if !list.is_empty() && self.rng.random_bool(0.8) => {
                let (i, j) = (self.index(list.len()), self.index(list.len()));
                match self.rng.random_range(0..4) {
                    0 => {
                        list.remove(i);
                    }
                    1 => list.insert(j, list[i].clone()),
                    2 => list.swap(i, j),
                    _ => list[i] = self.leaf(),
                }
            }
            Value::Object(map) if !map.is_empty() && self.rng.random_bool(0.8) => {
                let keys: Vec<String> = map.keys().cloned().collect();
                let key = keys[self.index(keys.len())].clone();
                match self.rng.random_range(0..4) {
                    0 => {
                        map.remove(&key);
                    }
                    1 => {
                        let from = keys[self.index(keys.len())].clone();
                        let copy = map[&from].clone();
                        map.insert(key, copy);
                    }
                    2 => {
                        let word = self.words.choose(&mut self.rng).copied().unwrap_or("x");
                        let value = map.remove(&key).unwrap_or_default();
                        map.insert(word.into(), value);
                    }
                    _ => {
                        let value = self.leaf();
                        map.insert(key, value);
                    }
                }
            }
            other => *other = self.leaf(),
        }
    }

    fn leaf(&mut self) -> Value {
        match self.rng.random_range(0..10) {
            0 => Value::Null,
            1 => Value::Bool(true),
            2 => Value::Array(vec![]),
            3 => Value::Object(Map::new()),
            4 => {
                let depth = self.rng.random_range(1..DEEP);
                (0..depth).fold(Value::Null, |v, _| Value::Array(vec![v]))
            }
            5 => Value::from(self.integer()),
            6 => Value::from(self.integer() as i64),
            7 => self
                .words
                .choose(&mut self.rng)
                .copied()
                .unwrap_or("")
                .into(),
            _ => {
                let text = NUMBERS[self.rng.random_range(0..NUMBERS.len())];
                let number = text.parse().ok().and_then(Number::from_f64);
                number.map_or_else(|| text.into(), Value::Number)
            }
        }
    }
}

fn children(v: &Value) -> Vec<&Value> {
    match v {
        Value::Array(l) => l.iter().collect(),
        Value::Object(m) => m.values().collect(),
        _ => vec![],
    }
}

fn nodes(v: &Value) -> usize {
    1 + children(v).into_iter().map(nodes).sum::<usize>()
}

/// Node `n` in depth-first order; `n` counts down.
fn nth<'a>(v: &'a mut Value, n: &mut usize) -> Option<&'a mut Value> {
    if *n == 0 {
        return Some(v);
    }
    *n -= 1;
    match v {
        Value::Array(l) => l.iter_mut().find_map(|c| nth(c, n)),
        Value::Object(m) => m.values_mut().find_map(|c| nth(c, n)),
        _ => None,
    }
}
