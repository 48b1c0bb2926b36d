//! What a scene file holds that is left out or repaired.

/// At most this many sentences are kept: a hostile file could otherwise cause one for each of its million parts.
const MAX_KEPT: usize = 64;

/// Collects warnings: no sentence twice, and a bounded number of them.
#[derive(Default)]
pub(super) struct Warnings {
    kept: Vec<String>,
    left_out: usize,
}

impl Warnings {
    /// Adds one sentence.
    pub fn push(&mut self, sentence: impl Into<String>) {
        let sentence = sentence.into();
        if self.kept.contains(&sentence) {
            return;
        }
        if self.kept.len() < MAX_KEPT {
            self.kept.push(sentence);
        } else {
            self.left_out += 1;
        }
    }

    /// The sentences, and how many more there were.
    pub fn into_sentences(mut self) -> Vec<String> {
        if self.left_out > 0 {
            self.kept
                .push(format!("and {} more warnings", self.left_out));
        }
        self.kept
    }
}
