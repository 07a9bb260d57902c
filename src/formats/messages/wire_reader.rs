//! Fields of ROS messages: CDR of ROS 2 (OMG DDSI-RTPS 10, XTypes 7.4) and the packed form of ROS 1.

use super::fault::MessageFault;

/// Serialisation of ROS messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RosWire {
    /// ROS 1: little-endian, packed.
    Ros1,
    /// ROS 2: aligned, after a header of four bytes that states the byte order.
    Cdr,
}

/// Reader of fields in order.
pub(super) struct WireReader<'a> {
    /// Bytes after the header, from which alignment counts.
    bytes: &'a [u8],
    at: usize,
    wire: RosWire,
    is_big_endian: bool,
    /// Largest alignment, bytes: 8, or 4 in XCDR2.
    max_alignment: usize,
}

impl<'a> WireReader<'a> {
    /// # Errors
    /// A CDR header of another representation, such as parameter lists.
    pub(super) fn new(wire: RosWire, data: &'a [u8]) -> Result<Self, MessageFault> {
        let (bytes, is_big_endian, max_alignment) = match (wire, data) {
            (RosWire::Ros1, _) => (data, false, 1),
            (RosWire::Cdr, [0, kind @ (0 | 1), _, _, rest @ ..]) => (rest, *kind == 0, 8),
            (RosWire::Cdr, [0, kind @ (6 | 7), _, _, rest @ ..]) => (rest, *kind == 6, 4),
            (RosWire::Cdr, [a, b, _, _, ..]) => {
                let why = format!("representation {a:02x}{b:02x}, expected plain CDR");
                return Err(MessageFault::new("cdr", why));
            }
            _ => return Err(MessageFault::new("cdr", "no header")),
        };
        Ok(Self {
            bytes,
            at: 0,
            wire,
            is_big_endian,
            max_alignment,
        })
    }

    /// True for ROS 1.
    pub(super) fn is_ros1(&self) -> bool {
        self.wire == RosWire::Ros1
    }
    /// True at the end.
    pub(super) fn is_done(&self) -> bool {
        self.at >= self.bytes.len()
    }

    fn take(&mut self, field: &str, n: usize) -> Result<&'a [u8], MessageFault> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(taken) = rest.get(..n) else {
            let why = format!("{n} bytes, the message has {} more", rest.len());
            return Err(MessageFault::new(field, why));
        };
        self.at += n;
        Ok(taken)
    }

    fn number<const N: usize>(&mut self, field: &str) -> Result<[u8; N], MessageFault> {
        self.at = self.at.next_multiple_of(N.min(self.max_alignment));
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(field, N)?);
        if self.is_big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn u8(&mut self, field: &str) -> Result<u8, MessageFault> {
        self.number(field).map(u8::from_le_bytes)
    }
    pub(super) fn u32(&mut self, field: &str) -> Result<u32, MessageFault> {
        self.number(field).map(u32::from_le_bytes)
    }
    pub(super) fn f32(&mut self, field: &str) -> Result<f32, MessageFault> {
        self.number(field).map(f32::from_le_bytes)
    }
    pub(super) fn f64(&mut self, field: &str) -> Result<f64, MessageFault> {
        self.number(field).map(f64::from_le_bytes)
    }
    pub(super) fn f64s<const N: usize>(&mut self, field: &str) -> Result<[f64; N], MessageFault> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64(field)?;
        }
        Ok(values)
    }

    /// Sequence of doubles.
    pub(super) fn f64_sequence(&mut self, field: &str) -> Result<Vec<f64>, MessageFault> {
        /// Most values: distortion models have 14.
        const MOST: u32 = 64;
        let count = self.u32(field)?;
        if count > MOST {
            let why = format!("{count} values, expected at most {MOST}");
            return Err(MessageFault::new(field, why));
        }
        (0..count).map(|_| self.f64(field)).collect()
    }

    /// Sequence of bytes.
    pub(super) fn bytes(&mut self, field: &str) -> Result<&'a [u8], MessageFault> {
        let length = self.u32(field)?;
        self.take(field, length as usize)
    }

    /// Text; CDR ends it with a zero byte, which counts.
    pub(super) fn text(&mut self, field: &str) -> Result<&'a str, MessageFault> {
        let bytes = self.bytes(field)?;
        let bytes = match self.wire {
            RosWire::Cdr => bytes.strip_suffix(&[0]).unwrap_or(bytes),
            RosWire::Ros1 => bytes,
        };
        std::str::from_utf8(bytes).map_err(|_| MessageFault::new(field, "no UTF-8 text"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cdr_aligns_and_states_its_byte_order() {
        // u8 = 7, f64 = 1.5 at 8 (XCDR1) or 4 (XCDR2), text "ab".
        for (kind, pad) in [(0u8, 7), (1, 7), (6, 3), (7, 3)] {
            let is_big = kind % 2 == 0;
            let mut data = vec![0, kind, 0, 0, 7];
            data.resize(data.len() + pad, 0);
            let order = |mut b: Vec<u8>| {
                if is_big {
                    b.reverse();
                }
                b
            };
            data.extend(order(1.5f64.to_le_bytes().to_vec()));
            data.extend(order(3u32.to_le_bytes().to_vec()));
            data.extend(b"ab\0");
            let mut r = WireReader::new(RosWire::Cdr, &data).expect("a header");
            assert_eq!(r.u8("a"), Ok(7));
            assert_eq!(r.f64("b"), Ok(1.5));
            assert_eq!(r.text("c"), Ok("ab"));
            assert!(r.is_done());
        }
        assert!(WireReader::new(RosWire::Cdr, &[0, 3, 0, 0]).is_err());
        assert!(WireReader::new(RosWire::Cdr, &[0, 1]).is_err());
    }

    #[test]
    fn lengths_beyond_the_message_name_the_field() {
        let mut r = WireReader::new(RosWire::Ros1, &[255, 255, 255, 255, 1]).expect("no header");
        let e = r.bytes("data").expect_err("too long");
        assert_eq!(e.field, "data");
        let mut r = WireReader::new(RosWire::Ros1, &[200, 0, 0, 0]).expect("no header");
        assert!(r.f64_sequence("D").is_err());
    }
}
