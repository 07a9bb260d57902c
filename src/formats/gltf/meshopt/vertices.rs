//! Mode ATTRIBUTES: bytes of elements as differences to the previous element, each place of the element apart, in groups of 16
//! of 0, 2, 4 or 8 bits.

/// First byte of a stream, version 0.
const HEADER: u8 = 0xa0;
/// Elements of a group.
const GROUP: usize = 16;
/// Most elements of a block, and most bytes.
const BLOCK: (usize, usize) = (256, 8192);
/// Least bytes at the end of the stream, of which the last ones are the element before the first.
const LEAST_TAIL: usize = 32;

/// Elements of `stride` bytes.
///
/// # Errors
/// A stream of another version, or one that is too short or too long.
pub(super) fn decode(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    if stride == 0 || stride > 256 || !stride.is_multiple_of(4) {
        return Err(format!(
            "a stride of {stride}, expected a multiple of 4 up to 256"
        ));
    }
    match data.first() {
        Some(&HEADER) => {}
        Some(0xa1) => return Err("version 1 of the vertex codec is not read; export for EXT_meshopt_compression, or without".into()),
        _ => return Err("no stream of vertices".into()),
    }
    let short = || "the stream is too short".to_owned();
    let tail = data
        .len()
        .checked_sub(stride.max(LEAST_TAIL) + 1)
        .ok_or_else(short)?
        + 1;
    let mut previous = data[data.len() - stride..].to_vec();
    let mut stream = &data[1..tail];

    let block = BLOCK.0.min((BLOCK.1 / stride) & !(GROUP - 1));
    let mut out = vec![0; count * stride];
    for elements in out.chunks_mut(block * stride) {
        let n = elements.len() / stride;
        for (k, last) in previous.iter_mut().enumerate() {
            let groups = n.div_ceil(GROUP);
            let header;
            (header, stream) = stream
                .split_at_checked(groups.div_ceil(4))
                .ok_or_else(short)?;
            for group in 0..groups {
                let mode = header[group / 4] >> (2 * (group % 4)) & 3;
                let values;
                (values, stream) = unpacked(stream, mode).ok_or_else(short)?;
                let first = group * GROUP;
                for (i, value) in (first..n.min(first + GROUP)).zip(values) {
                    let difference = (value >> 1) ^ 0u8.wrapping_sub(value & 1);
                    *last = last.wrapping_add(difference);
                    elements[i * stride + k] = *last;
                }
            }
        }
    }
    if stream.is_empty() {
        Ok(out)
    } else {
        Err("the stream is too long".into())
    }
}

/// Values of a group and the rest of the stream; `None` if it is too short. Values that do not fit their bits follow them.
fn unpacked(stream: &[u8], mode: u8) -> Option<([u8; GROUP], &[u8])> {
    let mut out = [0; GROUP];
    let bits = match mode {
        0 => return Some((out, stream)),
        1 => 2,
        2 => 4,
        _ => {
            let (values, rest) = stream.split_at_checked(GROUP)?;
            out.copy_from_slice(values);
            return Some((out, rest));
        }
    };
    let (packed, mut rest) = stream.split_at_checked(GROUP * bits / 8)?;
    let per_byte = 8 / bits;
    let escape = (1u8 << bits) - 1;
    for (i, slot) in out.iter_mut().enumerate() {
        let shift = 8 - bits * (i % per_byte + 1);
        let value = packed[i / per_byte] >> shift & escape;
        *slot = value;
        if value == escape {
            let first;
            (first, rest) = rest.split_first()?;
            *slot = *first;
        }
    }
    Some((out, rest))
}
