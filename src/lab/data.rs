//! Data sets, and the door from files to [`crate::task::classify::Examples`].
