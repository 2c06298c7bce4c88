//! Axes as a person lists them.

use crate::motion::MAX_AXES;

/// Axes, from 0, in the order given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct AxisList(pub(super) Vec<usize>);

impl AxisList {
    /// The first that a cue of so many axes does not have, from 1.
    pub(super) fn missing(&self, axes: usize) -> Option<usize> {
        self.0.iter().find(|axis| **axis >= axes).map(|axis| axis + 1)
    }
}

/// `2`, `1,3` or `1-3`, counted from 1; each once.
pub(super) fn parse_axes(text: &str) -> Result<AxisList, String> {
    let refuse =
        || format!("{text:?} is no list of axes; write 2, or 1,3, or 1-3, from 1 to {MAX_AXES}, each once");
    let number = |text: &str| text.trim().parse().ok().filter(|axis| (1..=MAX_AXES).contains(axis));
    let mut axes = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (Some(first), Some(last)) = (number(first), number(last)) else { return Err(refuse()) };
        axes.extend(first - 1..last);
    }
    let is_once = (1..axes.len()).all(|place| !axes[..place].contains(&axes[place]));
    if axes.is_empty() || !is_once { Err(refuse()) } else { Ok(AxisList(axes)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_one_some_or_a_row_of_them_and_each_once() {
        assert_eq!(parse_axes("2"), Ok(AxisList(vec![1])));
        assert_eq!(parse_axes("3, 1"), Ok(AxisList(vec![2, 0])));
        assert_eq!(parse_axes("1-3,5"), Ok(AxisList(vec![0, 1, 2, 4])));
        for bad in ["", "0", "13", "1-", "3-1", "1,1", "1-3,2", "x", "1--2"] {
            assert!(parse_axes(bad).is_err(), "{bad}");
        }
        assert_eq!(AxisList(vec![0, 4]).missing(3), Some(5));
    }
}
