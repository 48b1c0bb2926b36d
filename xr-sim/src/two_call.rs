//! The two-call idiom of every enumeration (specification, "Buffer Size Parameters"), written once.

use openxr_sys as sys;

use crate::XrResult;
use crate::api::pointer::Out;

/// Tells the count where `capacity` is 0, else hands every element to `write` with its place in the buffer.
pub(crate) fn two_call<T, E>(
    capacity: u32,
    count: Out<u32>,
    buffer: Out<E>,
    elements: impl ExactSizeIterator<Item = T>,
    mut write: impl FnMut(Out<E>, T) -> XrResult<()>,
) -> XrResult<()> {
    let length = u32::try_from(elements.len()).map_err(|_| sys::Result::ERROR_RUNTIME_FAILURE)?;
    count.set(length)?;
    if capacity == 0 {
        return Ok(());
    }
    if capacity < length {
        return Err(sys::Result::ERROR_SIZE_INSUFFICIENT);
    }
    for (index, element) in elements.enumerate() {
        write(buffer.at(index)?, element)?;
    }
    Ok(())
}

/// [`two_call`] of plain values.
pub(crate) fn two_call_values<T: Copy>(
    capacity: u32,
    count: Out<u32>,
    buffer: Out<T>,
    values: &[T],
) -> XrResult<()> {
    two_call(
        capacity,
        count,
        buffer,
        values.iter().copied(),
        |out, value| out.set(value),
    )
}

/// [`two_call`] of a string with its closing zero.
pub(crate) fn two_call_string(
    capacity: u32,
    count: Out<u32>,
    buffer: Out<std::ffi::c_char>,
    string: &str,
) -> XrResult<()> {
    let mut bytes: Vec<_> = string
        .bytes()
        .map(|byte| byte as std::ffi::c_char)
        .collect();
    bytes.push(0);
    two_call_values(capacity, count, buffer, &bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of a call with room for `room` values, the count it told, and the buffer after it.
    fn enumerate(capacity: u32, values: &[u32]) -> (XrResult<()>, u32, [u32; 4]) {
        let (mut count, mut buffer) = (77, [99; 4]);
        let result = two_call_values(
            capacity,
            Out::to(&mut count),
            Out::to_slice(&mut buffer),
            values,
        );
        (result, count, buffer)
    }

    #[test]
    fn the_first_call_tells_the_count_and_writes_nothing() {
        assert_eq!(enumerate(0, &[1, 2, 3]), (Ok(()), 3, [99; 4]));
    }

    #[test]
    fn too_small_a_buffer_is_refused_untouched_with_the_count() {
        let refused = Err(sys::Result::ERROR_SIZE_INSUFFICIENT);
        assert_eq!(enumerate(2, &[1, 2, 3]), (refused, 3, [99; 4]));
    }

    #[test]
    fn a_buffer_with_room_to_spare_is_filled_from_its_start() {
        assert_eq!(enumerate(4, &[1, 2, 3]), (Ok(()), 3, [1, 2, 3, 99]));
    }

    #[test]
    fn a_missing_count_or_buffer_is_a_validation_failure() {
        let refused = Err(sys::Result::ERROR_VALIDATION_FAILURE);
        let (mut count, mut buffer) = (0, [0]);
        assert_eq!(
            two_call_values(0, Out::null(), Out::to_slice(&mut buffer), &[1]),
            refused
        );
        assert_eq!(
            two_call_values(1, Out::to(&mut count), Out::null(), &[1]),
            refused
        );
    }
}
