//! As many users as a session has.

use crate::keys::blank;
use crate::keys::parts::{FINGER, USER};
use crate::scene::User;

/// User `number`, counted from 1, of whom nothing is written.
pub(crate) fn unwritten(number: usize) -> User {
    User { name: format!("user{number}"), fingers: vec![blank(FINGER)], ..blank(USER) }
}

/// Gives a session of `count` users as many: users beyond those given repeat their scripts in turn.
pub(crate) fn fill_up(users: &mut Vec<User>, count: usize) {
    let given = users.len();
    users.truncate(count);
    for index in given..count {
        let fresh = unwritten(index + 1);
        users.push(if given == 0 {
            fresh
        } else {
            User { name: fresh.name, ..users[index % given].clone() }
        });
    }
}
