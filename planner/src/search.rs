//! Searching sorted lists where each search ends near the one before.

/// As [`slice::partition_point`], looked for at `near` and just after it first; `near` is left where it
/// was found.
#[inline]
pub(crate) fn partition_near<T>(
    list: &[T],
    near: &mut usize,
    is_before: impl Fn(&T) -> bool,
) -> usize {
    /// Steps from the place before, beyond which halving is quicker.
    const STEPS: usize = 2;
    let is_passed = |count: usize| count == 0 || list.get(count - 1).is_some_and(&is_before);
    if is_passed(*near) {
        for count in *near..=*near + STEPS {
            if list.get(count).is_none_or(|item| !is_before(item)) {
                *near = count.min(list.len());
                return *near;
            }
        }
    }
    *near = list.partition_point(is_before);
    *near
}

#[cfg(test)]
mod tests {
    use super::partition_near;

    #[test]
    fn a_search_from_anywhere_finds_what_a_search_of_all_finds() {
        let list = [1, 2, 2, 4, 7, 7, 7, 9];
        for value in 0..=10 {
            for start in 0..=list.len() + 3 {
                let mut near = start;
                let found = partition_near(&list, &mut near, |item| *item <= value);
                assert_eq!(found, list.partition_point(|item| *item <= value), "{value} {start}");
                assert_eq!(near, found);
            }
        }
        assert_eq!(partition_near::<i32>(&[], &mut 3, |_| true), 0);
    }
}
