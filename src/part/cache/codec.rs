//! Numbers and arrays to bytes and back. The reader compares every count with the bytes that are left before it allocates.

use crate::geometry::{Point3, Vector3};

/// Appends to a byte vector.
#[derive(Default)]
pub(super) struct Writer {
    pub(super) bytes: Vec<u8>,
}

impl Writer {
    pub(super) fn u64(&mut self, value: u64) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(super) fn f64(&mut self, value: f64) {
        self.bytes.extend(value.to_le_bytes());
    }

    pub(super) fn text(&mut self, text: &str) {
        self.u64(text.len() as u64);
        self.bytes.extend(text.as_bytes());
    }

    pub(super) fn vector(&mut self, v: &Vector3) {
        v.iter().for_each(|c| self.f64(*c));
    }

    pub(super) fn point(&mut self, p: &Point3) {
        self.vector(&p.coords);
    }

    pub(super) fn triples(&mut self, rows: impl ExactSizeIterator<Item = [f64; 3]>) {
        self.rows(rows.len(), rows, f64::to_le_bytes);
    }

    pub(super) fn words<const N: usize>(&mut self, rows: impl ExactSizeIterator<Item = [u32; N]>) {
        self.rows(rows.len(), rows, u32::to_le_bytes);
    }

    fn rows<T, const N: usize, const B: usize>(
        &mut self,
        count: usize,
        rows: impl Iterator<Item = [T; N]>,
        to_bytes: fn(T) -> [u8; B],
    ) {
        self.u64(count as u64);
        let start = self.bytes.len();
        self.bytes.resize(start + count * N * B, 0);
        for (place, row) in self.bytes[start..].chunks_exact_mut(N * B).zip(rows) {
            for (place, value) in place.chunks_exact_mut(B).zip(row) {
                place.copy_from_slice(&to_bytes(value));
            }
        }
    }
}

/// Takes from a byte slice; every method gives `None` when there is not enough of it.
pub(super) struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(head)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        let (head, rest) = self.rest.split_first_chunk()?;
        self.rest = rest;
        Some(u64::from_le_bytes(*head))
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.u64().map(f64::from_bits)
    }

    /// A count of things of at least `size` bytes each, of which so many can still be there.
    pub(super) fn count(&mut self, size: usize) -> Option<usize> {
        let count = usize::try_from(self.u64()?).ok()?;
        (count.checked_mul(size)? <= self.rest.len()).then_some(count)
    }

    pub(super) fn text(&mut self) -> Option<String> {
        let length = self.count(1)?;
        String::from_utf8(self.take(length)?.to_vec()).ok()
    }

    pub(super) fn vector(&mut self) -> Option<Vector3> {
        Some(Vector3::new(self.f64()?, self.f64()?, self.f64()?))
    }

    pub(super) fn point(&mut self) -> Option<Point3> {
        self.vector().map(Point3::from)
    }

    pub(super) fn triples(&mut self) -> Option<impl Iterator<Item = [f64; 3]> + use<'a>> {
        self.rows(f64::from_le_bytes)
    }

    pub(super) fn words<const N: usize>(&mut self) -> Option<impl Iterator<Item = [u32; N]> + use<'a, N>> {
        self.rows(u32::from_le_bytes)
    }

    fn rows<T: 'a, const N: usize, const B: usize>(
        &mut self,
        from_bytes: fn([u8; B]) -> T,
    ) -> Option<impl Iterator<Item = [T; N]> + use<'a, T, N, B>> {
        let count = self.count(N * B)?;
        let bytes = self.take(count * N * B)?;
        let value = move |chunk: &[u8], k: usize| {
            let mut b = [0; B];
            b.copy_from_slice(&chunk[k * B..(k + 1) * B]);
            from_bytes(b)
        };
        Some(bytes.chunks_exact(N * B).map(move |chunk| std::array::from_fn(|k| value(chunk, k))))
    }
}
