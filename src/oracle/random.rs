//! Random numbers of the oracle: SplitMix64 (Steele, Lea and Flood, OOPSLA 2014), a stream of its own for each key.

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct Random(u64);

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Random {
    /// The stream of a key: seed, frame, pixel and sample, for one.
    pub fn of(key: [u32; 4]) -> Self {
        Self(key.iter().fold(GOLDEN, |state, part| {
            mix(state.wrapping_add(GOLDEN) ^ u64::from(*part))
        }))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        (mix(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Two numbers.
    pub fn uniform2(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }
}
