//! Numbers that change little from one to the next, as columns: second differences, zigzag, in groups of 32 that are each as many bits
//! wide as their greatest. What goes on as it was needs none: zeros at the end are left out.

/// Second differences of a group: its bits are whole octets, however wide they are.
const GROUP: usize = 32;

/// A column: `kinocue.Column`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct Column {
    /// Groups of 32 second differences: an octet that says how many bits each takes, and these bits, the lowest first.
    #[prost(bytes = "vec", tag = "1")]
    pub(super) packed: Vec<u8>,
}

/// A column on its way.
#[derive(Debug, Default)]
struct ColumnWriter {
    /// Second differences that are in no octets yet, and the row of the first.
    group: [u64; GROUP],
    begun: usize,
    octets: Vec<u8>,
}

impl ColumnWriter {
    /// The second difference of a row, which is not 0.
    #[inline]
    fn push(&mut self, row: usize, second: i64) {
        while row >= self.begun + GROUP {
            self.close_group();
        }
        self.group[row - self.begun] = (second << 1 ^ second >> 63).cast_unsigned();
    }

    fn close_group(&mut self) {
        let width = u64::BITS - self.group.iter().fold(0, |all, one| all | one).leading_zeros();
        self.octets.push(width.to_le_bytes()[0]);
        let (mut bits, mut held) = (0_u128, 0);
        for word in std::mem::replace(&mut self.group, [0; GROUP]) {
            bits |= u128::from(word) << held;
            held += width;
            while held >= 8 {
                self.octets.push(bits.to_le_bytes()[0]);
                (bits, held) = (bits >> 8, held - 8);
            }
        }
        self.begun += GROUP;
    }

    /// What it came to. The next begins anew, in the same memory.
    fn take(&mut self) -> Column {
        if self.group.iter().any(|one| *one != 0) {
            self.close_group();
        }
        let used = self.octets.iter().rposition(|octet| *octet != 0).map_or(0, |last| last + 1);
        let column = Column { packed: self.octets[..used].to_vec() };
        self.octets.clear();
        *self = Self { octets: std::mem::take(&mut self.octets), ..Self::default() };
        column
    }
}

/// Columns side by side, on their way. What the next number of each is held against lies together: most numbers go on as they were, and then
/// nothing else of a column is looked at.
#[derive(Debug, Default)]
pub(super) struct ColumnSet {
    /// Rows so far.
    rows: usize,
    /// The last number of each, the step to it, and how that differs from the one before.
    last: Vec<i64>,
    step: Vec<i64>,
    second: Vec<i64>,
    writers: Vec<ColumnWriter>,
}

impl ColumnSet {
    /// The numbers of a row, which may be of fewer columns than there are: those that are left out, and whole rows, go on as before. Wraps, so
    /// that any numbers come back.
    #[inline]
    pub(super) fn push(&mut self, row: usize, numbers: &[i64]) {
        let columns = numbers.len().max(self.writers.len());
        if columns > self.writers.len() {
            [&mut self.last, &mut self.step, &mut self.second]
                .into_iter()
                .for_each(|all| all.resize(columns, 0));
            self.writers.resize_with(columns, ColumnWriter::default);
        }
        let left_out = i64::try_from(row - self.rows).unwrap_or_default();
        self.rows = row + 1;
        if left_out != 0 {
            go_on(&mut self.last, &self.step, left_out);
        }
        let told = numbers.len();
        go_on(&mut self.last[told..], &self.step[told..], 1);
        // Nothing here but numbers, so that several are taken at once.
        let kept = self.last.iter_mut().zip(&mut self.step).zip(&mut self.second);
        for (number, ((last, step), second)) in numbers.iter().zip(kept) {
            let now = number.wrapping_sub(*last);
            (*second, *last, *step) = (now.wrapping_sub(*step), *number, now);
        }
        for (at, second) in self.second[..told].iter().enumerate() {
            if *second != 0 {
                self.writers[at].push(row, *second);
            }
        }
    }

    /// What they came to, without those at the end that hold nothing. The next begin anew.
    pub(super) fn take(&mut self) -> Vec<Column> {
        self.rows = 0;
        [&mut self.last, &mut self.step].into_iter().for_each(|all| all.fill(0));
        let mut columns: Vec<Column> = self.writers.iter_mut().map(ColumnWriter::take).collect();
        let used = columns.iter().rposition(|column| !column.packed.is_empty());
        columns.truncate(used.map_or(0, |last| last + 1));
        columns
    }
}

/// The last numbers so many rows later.
fn go_on(last: &mut [i64], step: &[i64], rows: i64) {
    last.iter_mut().zip(step).for_each(|(last, step)| *last = last.wrapping_add(step.wrapping_mul(rows)));
}

/// Columns that are read, row by row; without end: they go on as they were.
pub(super) struct ColumnReaders<'a>(Vec<ColumnReader<'a>>);

impl<'a> ColumnReaders<'a> {
    pub(super) fn new(columns: &'a [Column]) -> Self {
        Self(
            columns
                .iter()
                .map(|column| ColumnReader { left: &column.packed, ..ColumnReader::default() })
                .collect(),
        )
    }

    /// The next of each column that is wanted, by its place; of a column it has to be wanted each time, or never.
    pub(super) fn next_of<const N: usize>(&mut self, wanted: [bool; N]) -> [i64; N] {
        let mut row = [0; N];
        let columns = row.iter_mut().zip(&mut self.0).zip(wanted).filter(|(_, is_wanted)| *is_wanted);
        columns.for_each(|((to, column), _)| *to = column.next());
        row
    }

    /// The next of each column; 0 of those that are not there.
    pub(super) fn next<const N: usize>(&mut self) -> [i64; N] {
        let mut row = [0; N];
        row.iter_mut().zip(&mut self.0).for_each(|(to, column)| *to = column.next());
        row
    }
}

#[derive(Default)]
struct ColumnReader<'a> {
    left: &'a [u8],
    last: i64,
    step: i64,
    group: [u64; GROUP],
    /// Rows that were read.
    row: usize,
}

impl ColumnReader<'_> {
    fn next(&mut self) -> i64 {
        if self.row.is_multiple_of(GROUP) {
            self.read_group();
        }
        let word = self.group[self.row % GROUP];
        self.row += 1;
        let second = (word >> 1).cast_signed() ^ -(word & 1).cast_signed();
        self.step = self.step.wrapping_add(second);
        self.last = self.last.wrapping_add(self.step);
        self.last
    }

    fn read_group(&mut self) {
        let Some((width, rest)) = self.left.split_first() else {
            self.group = [0; GROUP];
            return;
        };
        // More is damage.
        let width = u32::from(*width).min(u64::BITS);
        let (packed, left) = rest.split_at(rest.len().min(GROUP / 8 * width as usize));
        self.left = left;
        let mut octets = packed.iter();
        let (mut bits, mut held) = (0_u128, 0);
        for word in &mut self.group {
            while held < width {
                bits |= u128::from(octets.next().copied().unwrap_or_default()) << held;
                held += 8;
            }
            let low = bits & ((1 << width) - 1);
            *word = u64::try_from(low).unwrap_or_default();
            (bits, held) = (bits >> width, held - width);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn number() -> impl Strategy<Value = i64> {
        prop_oneof![8 => -3_i64..4, 2 => -9_000_i64..9_000, 1 => any::<i64>()]
    }

    proptest! {
        #[test]
        fn any_numbers_come_back_and_rows_that_are_left_out_go_on_as_before(
            rows in prop::collection::vec(prop::option::weighted(0.9, number()), 0..200),
        ) {
            let mut columns = ColumnSet::default();
            for _ in 0..2 {
                for (row, number) in rows.iter().enumerate() {
                    columns.push(row, number.as_slice());
                }
                let taken = columns.take();
                let mut readers = ColumnReaders::new(&taken);
                let (mut last, mut step) = (0_i64, 0_i64);
                for number in &rows {
                    let wanted = number.unwrap_or(last.wrapping_add(step));
                    (last, step) = (wanted, wanted.wrapping_sub(last));
                    prop_assert_eq!(readers.next::<1>(), [wanted]);
                }
            }
        }

        #[test]
        fn no_octets_panic(packed in prop::collection::vec(any::<u8>(), 0..200)) {
            let columns = [Column { packed }];
            let mut readers = ColumnReaders::new(&columns);
            (0..300).for_each(|_| { readers.next::<2>(); });
        }
    }

    #[test]
    fn what_moves_evenly_takes_a_few_octets_and_what_trembles_by_a_pulse_two_bits() {
        let mut columns = ColumnSet::default();
        (0..500).for_each(|row| columns.push(row, &[7 + 3 * i64::try_from(row).expect("few"), 0]));
        assert!(columns.take()[0].packed.len() < 40);
        // Second differences of -1, 0 and 1.
        (0..512_usize).for_each(|row| columns.push(row, &[i64::try_from(row * row / 4).expect("few")]));
        assert!(columns.take()[0].packed.len() <= 512 / 4 + 16 + 8);
    }
}
