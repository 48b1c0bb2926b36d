//! Swapchains: whose turn it is with which image.

use std::collections::VecDeque;

use openxr_sys as sys;

use crate::XrResult;
use crate::handle::Object;
use crate::vulkan::SwapchainImages;

/// The images that an application draws into by turns.
pub(crate) struct Swapchain {
    pub session: sys::Session,
    /// Width and height, in pixels.
    pub size: [u32; 2],
    pub array_size: u32,
    pub queue: ImageQueue,
    pub images: SwapchainImages,
}

impl Object for Swapchain {
    type Handle = sys::Swapchain;
    const KIND: u8 = 4;
}

/// The order of `xrAcquireSwapchainImage`, `xrWaitSwapchainImage` and `xrReleaseSwapchainImage`.
#[derive(Debug)]
pub(crate) struct ImageQueue {
    count: u32,
    is_static: bool,
    next: u32,
    /// Oldest first; the first of them may have been waited for.
    acquired: VecDeque<u32>,
    is_waited: bool,
    last_released: Option<u32>,
}

impl ImageQueue {
    /// `is_static`: one image, to be acquired once.
    pub fn new(count: u32, is_static: bool) -> Self {
        Self {
            count,
            is_static,
            next: 0,
            acquired: VecDeque::new(),
            is_waited: false,
            last_released: None,
        }
    }

    pub fn acquire(&mut self) -> XrResult<u32> {
        let is_spent = self.is_static && self.last_released.is_some();
        if self.acquired.len() == self.count as usize || is_spent {
            return Err(sys::Result::ERROR_CALL_ORDER_INVALID);
        }
        let index = self.next;
        self.next = (index + 1) % self.count;
        self.acquired.push_back(index);
        Ok(index)
    }

    /// The compositor is done with an image when `xrEndFrame` returns, so there is nothing to wait for.
    pub fn wait(&mut self) -> XrResult<()> {
        if self.acquired.is_empty() || self.is_waited {
            return Err(sys::Result::ERROR_CALL_ORDER_INVALID);
        }
        self.is_waited = true;
        Ok(())
    }

    pub fn release(&mut self) -> XrResult<()> {
        if !self.is_waited {
            return Err(sys::Result::ERROR_CALL_ORDER_INVALID);
        }
        self.is_waited = false;
        self.last_released = self.acquired.pop_front();
        Ok(())
    }

    /// The image that a layer shows.
    pub fn last_released(&self) -> Option<u32> {
        self.last_released
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFUSED: sys::Result = sys::Result::ERROR_CALL_ORDER_INVALID;

    #[test]
    fn images_come_by_turns_and_are_released_in_order() {
        let mut queue = ImageQueue::new(3, false);
        assert_eq!(queue.last_released(), None);
        for turn in 0..7 {
            assert_eq!(queue.acquire(), Ok(turn % 3));
            assert_eq!(queue.wait(), Ok(()));
            assert_eq!(queue.release(), Ok(()));
            assert_eq!(queue.last_released(), Some(turn % 3));
        }
    }

    #[test]
    fn calls_out_of_order_are_refused() {
        let mut queue = ImageQueue::new(2, false);
        assert_eq!(queue.wait(), Err(REFUSED), "nothing is acquired");
        assert_eq!(queue.release(), Err(REFUSED), "nothing is waited for");
        assert_eq!((queue.acquire(), queue.acquire()), (Ok(0), Ok(1)));
        assert_eq!(queue.acquire(), Err(REFUSED), "all are acquired");
        assert_eq!(
            queue.release(),
            Err(REFUSED),
            "acquired, but not waited for"
        );
        assert_eq!(queue.wait(), Ok(()));
        assert_eq!(
            queue.wait(),
            Err(REFUSED),
            "the first is to be released before the second's turn"
        );
        assert_eq!(queue.release(), Ok(()));
        assert_eq!(queue.last_released(), Some(0));
        assert_eq!((queue.wait(), queue.release()), (Ok(()), Ok(())));
        assert_eq!(queue.last_released(), Some(1));
    }

    #[test]
    fn a_static_image_is_acquired_once() {
        let mut queue = ImageQueue::new(1, true);
        assert_eq!(
            (queue.acquire(), queue.wait(), queue.release()),
            (Ok(0), Ok(()), Ok(()))
        );
        assert_eq!(queue.acquire(), Err(REFUSED));
    }
}
