//! A value for each axis of a message, without allocation.

use std::ops::Deref;

use crate::motion::MAX_AXES;

/// Up to 12 values, axis 1 first; reads as the slice of those there are.
#[derive(Clone, Copy)]
pub struct PerAxis<T> {
    len: u8,
    values: [T; MAX_AXES],
}

impl<T: Copy + Default> PerAxis<T> {
    /// The values of `slice`; those past the twelfth are left out.
    #[must_use]
    pub fn new(slice: &[T]) -> Self {
        Self::from_fn(slice.len(), |axis| slice[axis])
    }

    /// The values that `value` gives for axes 0 to `axes` - 1; at most 12 are asked for.
    #[inline]
    pub fn from_fn(axes: usize, mut value: impl FnMut(usize) -> T) -> Self {
        let mut values = [T::default(); MAX_AXES];
        let mut len = 0;
        for (axis, slot) in values.iter_mut().enumerate().take(axes) {
            *slot = value(axis);
            len += 1;
        }
        Self { len, values }
    }
}

impl<T> Deref for PerAxis<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        &self.values[..usize::from(self.len)]
    }
}

impl<T: Copy + Default> Default for PerAxis<T> {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl<T: PartialEq> PartialEq for PerAxis<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Eq> Eq for PerAxis<T> {}

impl<T: std::fmt::Debug> std::fmt::Debug for PerAxis<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        (**self).fmt(f)
    }
}
