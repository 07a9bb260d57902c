//! Mutations of protobuf messages, on their wire format and without their schema.

use super::Mutator;
use prost::encoding::{decode_varint, encode_varint};
use rand::Rng;

/// Value of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Value {
    Varint(u64),
    Fixed64([u8; 8]),
    Bytes(Vec<u8>),
    Fixed32([u8; 4]),
}

/// Field with its number.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Field {
    number: u64,
    value: Value,
}

/// Most copies of a repeated field in one mutation.
const COPIES: usize = 70;

impl Mutator<'_> {
    pub(super) fn message(&mut self, b: &mut Vec<u8>, donor: &[u8]) {
        let Some(mut fields) = parse(b) else {
            return self.bytes(b, donor);
        };
        self.fields(&mut fields, donor);
        *b = write(&fields);
    }

    fn fields(&mut self, fields: &mut Vec<Field>, donor: &[u8]) {
        if fields.is_empty() {
            let value = Value::Varint(self.integer());
            fields.push(Field { number: 1, value });
            return;
        }
        let (i, j) = (self.index(fields.len()), self.index(fields.len()));
        match self.rng.random_range(0..12) {
            0 => {
                fields.remove(i);
            }
            1 => {
                let times = self.rng.random_range(1..COPIES);
                let copy = fields[i].clone();
                fields.splice(j..j, std::iter::repeat_n(copy, times));
            }
            2 => fields.swap(i, j),
            3 => fields[i].number = self.rng.random_range(1..20),
            4 => {
                let number = self.rng.random_range(1..20);
                let value = Value::Varint(self.integer());
                fields.insert(i, Field { number, value });
            }
            _ => self.value(&mut fields[i].value, donor),
        }
    }

    fn value(&mut self, value: &mut Value, donor: &[u8]) {
        match value {
            Value::Varint(n) => *n = self.integer(),
            Value::Fixed64(b) => *b = self.real().to_le_bytes(),
            Value::Fixed32(b) if self.rng.random_bool(0.5) => {
                *b = (self.real() as f32).to_le_bytes();
            }
            Value::Fixed32(b) => *b = (self.integer() as u32).to_le_bytes(),
            Value::Bytes(b) => match parse(b) {
                // Text and arrays sometimes look like messages.
                Some(mut inner) if !inner.is_empty() && self.rng.random_bool(0.7) => {
                    self.fields(&mut inner, donor);
                    *b = write(&inner);
                }
                _ => self.bytes(b, donor),
            },
        }
    }
}

fn take<const N: usize>(b: &mut &[u8]) -> Option<[u8; N]> {
    let (head, rest) = b.split_first_chunk::<N>()?;
    *b = rest;
    Some(*head)
}

fn parse(mut b: &[u8]) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    while !b.is_empty() {
        let key = decode_varint(&mut b).ok()?;
        let value = match key & 7 {
            0 => Value::Varint(decode_varint(&mut b).ok()?),
            1 => Value::Fixed64(take(&mut b)?),
            2 => {
                let length = usize::try_from(decode_varint(&mut b).ok()?).ok()?;
                let (content, rest) = b.split_at_checked(length)?;
                b = rest;
                Value::Bytes(content.to_vec())
            }
            5 => Value::Fixed32(take(&mut b)?),
            _ => return None,
        };
        let number = key >> 3;
        if number == 0 {
            return None;
        }
        fields.push(Field { number, value });
    }
    Some(fields)
}

fn write(fields: &[Field]) -> Vec<u8> {
    let mut out = Vec::new();
    for f in fields {
        let kind = match f.value {
            Value::Varint(_) => 0,
            Value::Fixed64(_) => 1,
            Value::Bytes(_) => 2,
            Value::Fixed32(_) => 5,
        };
        encode_varint(f.number << 3 | kind, &mut out);
        match &f.value {
            Value::Varint(n) => encode_varint(*n, &mut out),
            Value::Fixed64(b) => out.extend_from_slice(b),
            Value::Bytes(b) => {
                encode_varint(b.len() as u64, &mut out);
                out.extend_from_slice(b);
            }
            Value::Fixed32(b) => out.extend_from_slice(b),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_back() {
        let fields = vec![
            Field {
                number: 1,
                value: Value::Varint(300),
            },
            Field {
                number: 2,
                value: Value::Bytes(b"abc".to_vec()),
            },
            Field {
                number: 19,
                value: Value::Fixed32([1, 2, 3, 4]),
            },
        ];
        assert_eq!(parse(&write(&fields)), Some(fields));
        assert_eq!(parse(&[0x0a, 5, 1]), None, "cut short");
    }
}
