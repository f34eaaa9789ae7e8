//! The roles of particles at a step.

/// The kinds of particle (the paper, section 2, with `Clamped` set apart from `Leader`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// Takes the position the rule computes from its neighbours.
    Follower,
    /// Moved from outside; followers react to it.
    Leader,
    /// A leader that does not move.
    Clamped,
    /// Part of the shell that gives edge particles their full neighbourhood; moved by the frame rule.
    Frame,
    /// Out of the body: it holds its place and every bond to it is broken.
    Ghost,
}

impl Role {
    /// Every role; files number them in this order.
    pub const ALL: [Role; 5] = [Role::Follower, Role::Leader, Role::Clamped, Role::Frame, Role::Ghost];

    /// The name in scene files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Role::Follower => "follower",
            Role::Leader => "leader",
            Role::Clamped => "clamped",
            Role::Frame => "frame",
            Role::Ghost => "ghost",
        }
    }

    /// Its place in [`Role::ALL`], which stands for it in files and messages.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Whether the particle goes where it is led or held rather than where the rule has it.
    pub fn is_led(self) -> bool {
        matches!(self, Role::Leader | Role::Clamped)
    }

    /// Whether the particle is matter: part of the body rather than scaffolding around it.
    pub fn is_body(self) -> bool {
        matches!(self, Role::Follower | Role::Leader | Role::Clamped)
    }
}
