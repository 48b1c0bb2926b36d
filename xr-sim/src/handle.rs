//! Handles that know when they are dead: each holds its kind, a place and the generation of that place.

use openxr_sys as sys;
use openxr_sys::Handle;

use crate::XrResult;

const KIND_SHIFT: u32 = 56;
const GENERATION_SHIFT: u32 = 32;
const MAX_GENERATION: u32 = (1 << (KIND_SHIFT - GENERATION_SHIFT)) - 1;

/// Something that an application holds by a handle.
pub(crate) trait Object {
    /// The API's handle type.
    type Handle: Handle;
    /// The tag in the handle's highest byte: not 0, and of this type alone.
    const KIND: u8;
}

/// All living objects of one type.
pub(crate) struct Slab<T> {
    slots: Vec<Slot<T>>,
    free: Vec<u32>,
}

struct Slot<T> {
    generation: u32,
    object: Option<T>,
}

impl<T> Slab<T> {
    pub const fn new() -> Self {
        Self {
            slots: Vec::new(),
            free: Vec::new(),
        }
    }
}

impl<T: Object> Slab<T> {
    pub fn insert(&mut self, object: T) -> T::Handle {
        let index = self.free.pop().unwrap_or_else(|| {
            self.slots.push(Slot {
                generation: 0,
                object: None,
            });
            self.slots.len() as u32 - 1
        });
        self.slots[index as usize].object = Some(object);
        self.handle(index)
    }

    pub fn get(&self, handle: T::Handle) -> XrResult<&T> {
        let (index, generation) = Self::split(handle)?;
        self.slots
            .get(index)
            .filter(|slot| slot.generation == generation)
            .and_then(|slot| slot.object.as_ref())
            .ok_or(sys::Result::ERROR_HANDLE_INVALID)
    }

    pub fn get_mut(&mut self, handle: T::Handle) -> XrResult<&mut T> {
        let (index, generation) = Self::split(handle)?;
        self.slots
            .get_mut(index)
            .filter(|slot| slot.generation == generation)
            .and_then(|slot| slot.object.as_mut())
            .ok_or(sys::Result::ERROR_HANDLE_INVALID)
    }

    /// Takes the object out; its handle is dead from here on.
    pub fn remove(&mut self, handle: T::Handle) -> XrResult<T> {
        self.get(handle)?;
        let (index, _) = Self::split(handle)?;
        self.vacate(index).ok_or(sys::Result::ERROR_HANDLE_INVALID)
    }

    /// Drops every object that `dead` names, as when their parent goes.
    pub fn remove_where(&mut self, dead: impl Fn(&T) -> bool) {
        for index in 0..self.slots.len() {
            if self.slots[index].object.as_ref().is_some_and(&dead) {
                self.vacate(index);
            }
        }
    }

    /// The living objects, oldest place first.
    pub fn iter(&self) -> impl Iterator<Item = (T::Handle, &T)> {
        self.slots.iter().enumerate().filter_map(|(index, slot)| {
            slot.object
                .as_ref()
                .map(|object| (self.handle(index as u32), object))
        })
    }

    fn vacate(&mut self, index: usize) -> Option<T> {
        let slot = &mut self.slots[index];
        // a place whose generations are used up stays empty, so that no handle ever comes back to life
        if slot.generation < MAX_GENERATION {
            slot.generation += 1;
            self.free.push(index as u32);
        }
        slot.object.take()
    }

    fn handle(&self, index: u32) -> T::Handle {
        let generation = u64::from(self.slots[index as usize].generation);
        T::Handle::from_raw(
            u64::from(T::KIND) << KIND_SHIFT | generation << GENERATION_SHIFT | u64::from(index),
        )
    }

    fn split(handle: T::Handle) -> XrResult<(usize, u32)> {
        let raw = handle.into_raw();
        if raw >> KIND_SHIFT != u64::from(T::KIND) {
            return Err(sys::Result::ERROR_HANDLE_INVALID);
        }
        Ok((
            raw as u32 as usize,
            (raw >> GENERATION_SHIFT) as u32 & MAX_GENERATION,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Thing(u32);
    impl Object for Thing {
        type Handle = sys::Space;
        const KIND: u8 = 9;
    }

    struct OtherKind;
    impl Object for OtherKind {
        type Handle = sys::Space;
        const KIND: u8 = 10;
    }

    #[test]
    fn a_living_handle_finds_its_object() {
        let mut things = Slab::new();
        let (a, b) = (things.insert(Thing(1)), things.insert(Thing(2)));
        assert_eq!(things.get(a).map(|thing| thing.0), Ok(1));
        assert_eq!(things.get_mut(b).map(|thing| thing.0), Ok(2));
        assert_eq!(things.iter().count(), 2);
    }

    #[test]
    fn a_dead_handle_stays_dead_when_its_place_is_used_again() {
        let mut things = Slab::new();
        let old = things.insert(Thing(1));
        assert!(things.remove(old).is_ok());
        let new = things.insert(Thing(2));
        assert_eq!(
            new.into_raw() as u32,
            old.into_raw() as u32,
            "the place is used again"
        );
        assert!(things.get(old).is_err());
        assert!(things.remove(old).is_err());
        assert_eq!(things.get(new).map(|thing| thing.0), Ok(2));
    }

    #[test]
    fn null_made_up_and_foreign_handles_are_refused() {
        let mut things: Slab<Thing> = Slab::new();
        let thing = things.insert(Thing(1));
        let foreign = Slab::<OtherKind>::new().insert(OtherKind);
        for handle in [sys::Space::NULL, sys::Space::from_raw(u64::MAX), foreign] {
            assert!(things.get(handle).is_err());
        }
        assert!(things.get(thing).is_ok());
    }

    #[test]
    fn objects_die_with_their_parent() {
        let mut things = Slab::new();
        let (odd, even) = (things.insert(Thing(1)), things.insert(Thing(2)));
        things.remove_where(|thing| thing.0 % 2 == 1);
        assert!(things.get(odd).is_err());
        assert!(things.get(even).is_ok());
    }
}
