//! Numbers that change little from one to the next, as columns: second differences, which protobuf packs as zigzag varints of a byte
//! or two. What goes on as it was needs none: zeros at the end are left out.

/// The second differences of these numbers, without the zeros at their end. Wraps, so that any numbers come back.
pub(super) fn fold(numbers: impl IntoIterator<Item = i64>) -> Vec<i64> {
    let (mut last, mut step) = (0_i64, 0_i64);
    let difference = |number: i64| {
        let next = number.wrapping_sub(last);
        let second = next.wrapping_sub(step);
        (last, step) = (number, next);
        second
    };
    let mut column: Vec<i64> = numbers.into_iter().map(difference).collect();
    column.truncate(column.iter().rposition(|one| *one != 0).map_or(0, |last| last + 1));
    column
}

/// The numbers of a column, without end: it goes on as it was.
pub(super) fn unfold(column: &[i64]) -> impl Iterator<Item = i64> + '_ {
    let (mut last, mut step) = (0_i64, 0_i64);
    column.iter().copied().chain(std::iter::repeat(0)).map(move |second| {
        step = step.wrapping_add(second);
        last = last.wrapping_add(step);
        last
    })
}
