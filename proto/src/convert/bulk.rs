//! Arrays as bytes: little endian, tightly packed; lengths are checked before allocation.

use super::WireError;
use bytes::{BufMut, Bytes, BytesMut};

/// Number type of an array.
pub(super) trait Element: Copy {
    const SIZE: usize;
    fn read(b: &[u8]) -> Self;
    fn write(self, out: &mut BytesMut);
    fn is_finite(self) -> bool;
}

macro_rules! element {
    ($t:ty, $finite:expr) => {
        impl Element for $t {
            const SIZE: usize = std::mem::size_of::<$t>();
            fn read(b: &[u8]) -> Self {
                let mut a = [0; std::mem::size_of::<$t>()];
                a.copy_from_slice(b);
                <$t>::from_le_bytes(a)
            }
            fn write(self, out: &mut BytesMut) {
                out.put_slice(&self.to_le_bytes());
            }
            fn is_finite(self) -> bool {
                #[allow(clippy::redundant_closure_call)]
                ($finite)(self)
            }
        }
    };
}
element!(u8, |_| true);
element!(i16, |_| true);
element!(u32, |_| true);
element!(f32, f32::is_finite);
element!(f64, f64::is_finite);

/// Reads `[rows][N]` elements; the byte length must be exactly that, and every number finite.
pub(super) fn read<T: Element, const N: usize>(
    field: &str,
    rows: usize,
    b: &Bytes,
) -> Result<Vec<[T; N]>, WireError> {
    let expected = rows.checked_mul(N * T::SIZE);
    if expected != Some(b.len()) {
        let why = format!(
            "{} bytes, but {rows} × {N} elements of {} bytes are needed",
            b.len(),
            T::SIZE
        );
        return Err(WireError::new(field, why));
    }
    let mut out = Vec::with_capacity(rows);
    for (i, row) in b.chunks_exact(N * T::SIZE).enumerate() {
        let values: [T; N] = std::array::from_fn(|k| T::read(&row[k * T::SIZE..(k + 1) * T::SIZE]));
        if values.iter().any(|v| !v.is_finite()) {
            return Err(WireError::new(format!("{field}[{i}]"), "is not finite"));
        }
        out.push(values);
    }
    Ok(out)
}

/// Reads a flat array of any length up to `limit` elements.
pub(super) fn read_flat<T: Element>(
    field: &str,
    limit: usize,
    b: &Bytes,
) -> Result<Vec<T>, WireError> {
    if !b.len().is_multiple_of(T::SIZE) {
        return Err(WireError::new(
            field,
            format!("{} bytes are no multiple of {}", b.len(), T::SIZE),
        ));
    }
    let rows = b.len() / T::SIZE;
    if rows > limit {
        return Err(WireError::new(
            field,
            format!("{rows} elements, at most {limit} make sense"),
        ));
    }
    Ok(read::<T, 1>(field, rows, b)?
        .into_iter()
        .map(|[v]| v)
        .collect())
}

/// Packs rows.
pub(super) fn write<T: Element, const N: usize>(
    rows: impl ExactSizeIterator<Item = [T; N]>,
) -> Bytes {
    let mut out = BytesMut::with_capacity(rows.len() * N * T::SIZE);
    rows.for_each(|row| row.into_iter().for_each(|v| v.write(&mut out)));
    out.freeze()
}

/// Packs a flat array.
pub(super) fn write_flat<T: Element>(values: &[T]) -> Bytes {
    write(values.iter().map(|&v| [v]))
}

/// Checks a count against `limit`, before any allocation.
pub(super) fn count(field: &str, n: u32, limit: u32) -> Result<usize, WireError> {
    if n > limit {
        return Err(WireError::new(
            field,
            format!("{n} is too many, at most {limit}"),
        ));
    }
    Ok(n as usize)
}

/// Triangles whose indices are below `vertices`.
pub(super) fn faces(
    field: &str,
    rows: usize,
    vertices: usize,
    b: &Bytes,
) -> Result<Vec<[u32; 3]>, WireError> {
    let faces = read::<u32, 3>(field, rows, b)?;
    for (i, f) in faces.iter().enumerate() {
        if let Some(&bad) = f.iter().find(|&&v| v as usize >= vertices) {
            let why = format!("vertex index {bad} is out of range (there are {vertices} vertices)");
            return Err(WireError::new(format!("{field}[{i}]"), why));
        }
    }
    Ok(faces)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_round_trip_and_faults_name_their_field() {
        let rows = [[1.5f32, -2.0, 3.25], [0.0, f32::MIN_POSITIVE, 1e30]];
        let b = write(rows.iter().copied());
        assert_eq!(read::<f32, 3>("x", 2, &b).expect("same size"), rows);
        assert_eq!(read::<f32, 3>("x", 3, &b).expect_err("short").field, "x");
        assert!(
            read::<f32, 3>("x", usize::MAX, &b).is_err(),
            "the product overflows and must not allocate"
        );
        let nan = write([[1.0f32, f32::NAN]].into_iter());
        assert_eq!(read::<f32, 2>("x", 1, &nan).expect_err("NaN").field, "x[0]");
        assert_eq!(count("n", u32::MAX, 10).expect_err("4 G").field, "n");
        let f = write([[0u32, 1, 7]].into_iter());
        assert_eq!(faces("f", 1, 3, &f).expect_err("hole").field, "f[0]");
        assert!(read_flat::<f64>("d", 8, &Bytes::from_static(&[0; 9])).is_err());
        assert!(read_flat::<f64>("d", 1, &Bytes::from_static(&[0; 16])).is_err());
    }
}
