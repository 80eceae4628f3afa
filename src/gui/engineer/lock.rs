//! The lock before the plan: a password that only its salted hash is kept of, and a time after which it locks by itself.

use argon2::Argon2;
use argon2::password_hash::phc::PasswordHash;
use argon2::password_hash::{PasswordHasher, PasswordVerifier};
use std::fmt;
use std::time::{Duration, Instant};

/// Letters that a password has at least.
pub const LEAST: usize = 8;
/// Without a touch of keys or pointer for so long, it locks.
pub const IDLE: Duration = Duration::from_secs(20 * 60);
/// The longest wait after a wrong password.
const LONGEST_WAIT: Duration = Duration::from_secs(30);

/// A password on its way to be hashed; never shown.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// What was typed.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// Whether it has enough letters.
    pub fn is_long_enough(&self) -> bool {
        self.0.chars().count() >= LEAST
    }

    /// Its salted hash, as a PHC string. Takes a good part of a second, and 19 MiB, on purpose.
    ///
    /// # Errors
    /// The system gives no random salt; in its words.
    pub fn hash(&self) -> Result<String, String> {
        Argon2::default().hash_password(self.0.as_bytes()).map(|hash| hash.to_string()).map_err(|e| e.to_string())
    }

    /// Whether a hash was made of it; takes as long. A hash that cannot be read is of no password.
    pub fn is_of(&self, hash: &str) -> bool {
        PasswordHash::new(hash).is_ok_and(|hash| Argon2::default().verify_password(self.0.as_bytes(), &hash).is_ok())
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret")
    }
}

/// Why it did not open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// Another password than the one that was set.
    Wrong,
    /// A new password of too few letters.
    Short,
    /// A new password that was typed differently the second time.
    Different,
    /// It could not be hashed, in the system's words.
    Failed(String),
}

/// Whether the plan can be changed.
#[derive(Debug, Clone, Default)]
pub struct Lock {
    open_until: Option<Instant>,
    /// Wrong passwords in a row.
    wrong: u32,
    wait_until: Option<Instant>,
    /// A password is being hashed.
    pub busy: bool,
    /// Why the last one did not open it.
    pub fault: Option<Fault>,
}

impl Lock {
    /// How long it stays open if nobody touches anything; `None` = it is locked.
    pub fn left(&self, now: Instant) -> Option<Duration> {
        self.open_until.map(|until| until.saturating_duration_since(now)).filter(|left| !left.is_zero())
    }

    /// Whether the plan can be changed.
    pub fn is_open(&self, now: Instant) -> bool {
        self.left(now).is_some()
    }

    /// How long the next password must wait.
    pub fn wait(&self, now: Instant) -> Option<Duration> {
        self.wait_until.map(|until| until.saturating_duration_since(now)).filter(|left| !left.is_zero())
    }

    /// Opens it.
    pub fn open(&mut self, now: Instant) {
        *self = Self { open_until: Some(now + IDLE), ..Self::default() };
    }

    /// Somebody is there: an open lock stays open.
    pub fn touch(&mut self, now: Instant) {
        if self.is_open(now) {
            self.open_until = Some(now + IDLE);
        }
    }

    /// Locks it.
    pub fn lock(&mut self) {
        self.open_until = None;
    }

    /// A wrong password: each in a row makes the next one wait twice as long.
    pub fn refuse(&mut self, now: Instant) {
        self.busy = false;
        self.fault = Some(Fault::Wrong);
        let wait = Duration::from_secs(1 << self.wrong.min(5)).min(LONGEST_WAIT);
        self.wait_until = Some(now + wait);
        self.wrong += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_same_password_opens_and_no_two_hashes_are_alike() {
        let secret = Secret::new("blech & rand");
        let [one, other] = [secret.hash().unwrap(), secret.hash().unwrap()];
        assert!(one.starts_with("$argon2id$v=19$m=19456,t=2,p=1$") && one != other, "{one}");
        assert!(secret.is_of(&one) && secret.is_of(&other));
        assert!(!Secret::new("blech & Rand").is_of(&one) && !secret.is_of("") && !secret.is_of("$argon2id$odd"));
        assert!(Secret::new("åäöüßåäö").is_long_enough() && !Secret::new("1234567").is_long_enough());
        assert!(!format!("{secret:?}").contains("blech"));
    }

    #[test]
    fn it_locks_by_itself_and_slows_down_who_guesses() {
        let start = Instant::now();
        let at = |s: u64| start + Duration::from_secs(s);
        let mut lock = Lock::default();
        assert!(!lock.is_open(start));
        lock.touch(start);
        assert!(!lock.is_open(start));
        lock.open(start);
        assert_eq!(lock.left(at(60)), Some(Duration::from_secs(19 * 60)));
        lock.touch(at(60));
        assert!(lock.is_open(at(20 * 60 + 59)) && !lock.is_open(at(21 * 60)));
        lock.touch(at(21 * 60));
        assert!(!lock.is_open(at(21 * 60)));
        let mut waits = Vec::new();
        for _ in 0..7 {
            lock.refuse(start);
            waits.push(lock.wait(start).unwrap().as_secs());
        }
        assert_eq!((waits, lock.wait(at(30))), (vec![1, 2, 4, 8, 16, 30, 30], None));
        lock.open(start);
        assert_eq!((lock.wait(start), &lock.fault), (None, &None));
    }
}
