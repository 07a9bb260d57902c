//! Modes TRIANGLES and INDICES: vertex indices by recently used edges and vertices, or as differences.

/// First byte of a stream of triangles, version 0 or 1.
const TRIANGLES: [u8; 2] = [0xe0, 0xe1];
/// First byte of a sequence, version 0 or 1.
const SEQUENCE: [u8; 2] = [0xd0, 0xd1];
/// Bytes of the table of frequent codes at the end of a stream of triangles.
const TABLE: usize = 16;
/// Zero bytes at the end of a sequence.
const SEQUENCE_TAIL: usize = 4;

fn short() -> String {
    "the stream is too short".into()
}

/// Bytes of differences to come.
struct Differences<'d> {
    data: &'d [u8],
    last: u32,
}

impl Differences<'_> {
    fn byte(&mut self) -> Result<u8, String> {
        let (first, rest) = self.data.split_first().ok_or_else(short)?;
        self.data = rest;
        Ok(*first)
    }
    /// Number of seven bits a byte, the lowest first; the highest bit says that more follow.
    fn number(&mut self) -> Result<u32, String> {
        let mut value = 0;
        for shift in (0..35).step_by(7) {
            let byte = self.byte()?;
            value |= u32::from(byte & 127).checked_shl(shift).unwrap_or(0);
            if byte < 128 {
                break;
            }
        }
        Ok(value)
    }
    /// Next index, by its difference to the last one.
    fn index(&mut self) -> Result<u32, String> {
        self.last = self.last.wrapping_add(signed(self.number()?));
        Ok(self.last)
    }
}

/// Signed number, two's complement, of its zigzag code.
fn signed(code: u32) -> u32 {
    (code >> 1) ^ 0u32.wrapping_sub(code & 1)
}

/// The last sixteen items.
struct Recent<T> {
    items: [T; 16],
    next: usize,
}

impl<T: Copy> Recent<T> {
    fn new(item: T) -> Self {
        Self {
            items: [item; 16],
            next: 0,
        }
    }
    fn push(&mut self, item: T) {
        self.items[self.next] = item;
        self.next = (self.next + 1) % 16;
    }
    /// Item pushed `age` pushes before the last one.
    fn at(&self, age: u8) -> T {
        self.items[(self.next + 15 - usize::from(age & 15)) % 16]
    }
}

/// State of the decoder of triangles.
struct TriangleDecoder<'d> {
    edges: Recent<[u32; 2]>,
    vertices: Recent<u32>,
    /// Next vertex that no triangle has used.
    next: u32,
    differences: Differences<'d>,
    table: &'d [u8],
    /// Codes below refer to a recent vertex.
    recent_limit: u8,
}

impl TriangleDecoder<'_> {
    fn fresh(&mut self) -> u32 {
        self.next = self.next.wrapping_add(1);
        self.next.wrapping_sub(1)
    }
    /// Triangle of a code.
    fn triangle(&mut self, code: u8) -> Result<[u32; 3], String> {
        match code {
            ..0xf0 => self.on_edge(code),
            0xf0..0xfe => {
                let pair = self.table[usize::from(code & 15)];
                self.free(0, pair)
            }
            _ => {
                let pair = self.differences.byte()?;
                if pair == 0 {
                    self.next = 0;
                }
                self.free(if code == 0xfe { 0 } else { 15 }, pair)
            }
        }
    }
    /// Triangle on a recent edge.
    fn on_edge(&mut self, code: u8) -> Result<[u32; 3], String> {
        let [a, b] = self.edges.at(code >> 4);
        let code = code & 15;
        let (c, is_new) = if code == 0 {
            (self.fresh(), true)
        } else if code < self.recent_limit {
            (self.vertices.at(code), false)
        } else {
            let last = self.differences.last;
            let c = match code {
                13 => last.wrapping_sub(1),
                14 => last.wrapping_add(1),
                _ => self.differences.index()?,
            };
            self.differences.last = c;
            (c, true)
        };
        if is_new {
            self.vertices.push(c);
        }
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok([a, b, c])
    }
    /// Triangle away from recent edges; codes of the first corner and of the other two.
    fn free(&mut self, first: u8, pair: u8) -> Result<[u32; 3], String> {
        let codes = [first, pair >> 4, pair & 15];
        let mut corners = [0; 3];
        // Recent vertices count from before this triangle; differences come after the fresh vertices of all corners.
        for (corner, code) in corners.iter_mut().zip(codes) {
            *corner = match code {
                0 => self.fresh(),
                15 => 0,
                _ => self.vertices.at(code - 1),
            };
        }
        for (corner, code) in corners.iter_mut().zip(codes) {
            if code == 15 {
                *corner = self.differences.index()?;
            }
        }
        for (corner, code) in corners.iter().zip(codes) {
            if code == 0 || code == 15 {
                self.vertices.push(*corner);
            }
        }
        let [a, b, c] = corners;
        self.edges.push([b, a]);
        self.edges.push([c, b]);
        self.edges.push([a, c]);
        Ok(corners)
    }
}

/// Vertex indices of triangles, `size` bytes each.
///
/// # Errors
/// A stream of another version or length.
pub(super) fn decode_triangles(data: &[u8], count: usize, size: usize) -> Result<Vec<u8>, String> {
    let version = data
        .first()
        .and_then(|b| TRIANGLES.iter().position(|h| h == b));
    let version = version.ok_or("no stream of triangles")?;
    if !count.is_multiple_of(3) {
        return Err(format!("{count} indices do not make triangles"));
    }
    let (codes, rest) = data[1..].split_at_checked(count / 3).ok_or_else(short)?;
    let (differences, table) = rest
        .split_at_checked(rest.len().wrapping_sub(TABLE))
        .ok_or_else(short)?;
    let mut decoder = TriangleDecoder {
        edges: Recent::new([u32::MAX; 2]),
        vertices: Recent::new(u32::MAX),
        next: 0,
        differences: Differences {
            data: differences,
            last: 0,
        },
        table,
        recent_limit: if version == 0 { 15 } else { 13 },
    };
    let mut out = Vec::with_capacity(count * size);
    for code in codes {
        for index in decoder.triangle(*code)? {
            push(&mut out, index, size)?;
        }
    }
    match decoder.differences.data {
        [] => Ok(out),
        _ => Err("the stream is too long".into()),
    }
}

/// Vertex indices in any order, `size` bytes each.
///
/// # Errors
/// A stream of another version or length.
pub(super) fn decode_sequence(data: &[u8], count: usize, size: usize) -> Result<Vec<u8>, String> {
    if !data.first().is_some_and(|b| SEQUENCE.contains(b)) {
        return Err("no sequence of indices".into());
    }
    let end = data.len().checked_sub(SEQUENCE_TAIL).filter(|end| *end > 0);
    let mut stream = Differences {
        data: &data[1..end.ok_or_else(short)?],
        last: 0,
    };
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count * size);
    for _ in 0..count {
        let code = stream.number()?;
        let base = &mut last[(code & 1) as usize];
        *base = base.wrapping_add(signed(code >> 1));
        push(&mut out, *base, size)?;
    }
    match stream.data {
        [] => Ok(out),
        _ => Err("the stream is too long".into()),
    }
}

/// Adds an index of two or four bytes.
fn push(out: &mut Vec<u8>, index: u32, size: usize) -> Result<(), String> {
    match size {
        2 => out.extend((index as u16).to_le_bytes()),
        4 => out.extend(index.to_le_bytes()),
        _ => return Err(format!("indices of {size} bytes, expected 2 or 4")),
    }
    Ok(())
}
