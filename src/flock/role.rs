//! The roles of particles at a step.

named! {
    /// The kinds of particle (the paper, section 2, with `Clamped` set apart from `Leader`).
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum Role {
        /// Takes the position the rule computes from its neighbours.
        Follower => "follower",
        /// Moved from outside; followers react to it.
        Leader => "leader",
        /// A leader that does not move.
        Clamped => "clamped",
        /// Part of the shell that gives edge particles their full neighbourhood; moved by the frame rule.
        Frame => "frame",
        /// Out of the body: it holds its place and every bond to it is broken.
        Ghost => "ghost",
    }
}

impl Role {
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
