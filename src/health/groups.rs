//! Which controllers move one rigid seat together.

use crate::config::Controller;

/// The motion groups of a hall: controllers under one rigid seat share one, every other has its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Groups {
    /// The group of each controller.
    of: Vec<usize>,
    /// The controllers of each group.
    members: Vec<Vec<usize>>,
    names: Vec<String>,
}

impl Groups {
    /// The groups that the configuration names, in the order of their first controllers.
    #[must_use]
    pub(crate) fn of(controllers: &[Controller]) -> Self {
        Self::named(controllers.iter().map(|controller| controller.group.as_str()))
    }

    /// The groups of controllers whose groups have these names.
    pub fn named<'a>(names_of: impl IntoIterator<Item = &'a str>) -> Self {
        let mut groups = Self { of: Vec::new(), members: Vec::new(), names: Vec::new() };
        for (controller, name) in names_of.into_iter().enumerate() {
            let group = groups.group_called(name);
            groups.of.push(group);
            groups.members[group].push(controller);
        }
        groups
    }

    fn group_called(&mut self, name: &str) -> usize {
        self.names.iter().position(|known| known == name).unwrap_or_else(|| {
            self.names.push(name.to_owned());
            self.members.push(Vec::new());
            self.names.len() - 1
        })
    }

    /// How many groups there are.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        self.names.len()
    }

    /// How many controllers they have in all.
    #[must_use]
    pub(crate) fn controllers(&self) -> usize {
        self.of.len()
    }

    /// The group of a controller.
    ///
    /// # Panics
    /// If there is no such controller.
    #[must_use]
    pub(crate) fn group_of(&self, controller: usize) -> usize {
        self.of[controller]
    }

    /// The controllers of a group.
    ///
    /// # Panics
    /// If there is no such group.
    pub(crate) fn members(&self, group: usize) -> impl Iterator<Item = usize> {
        self.members[group].iter().copied()
    }

    /// What the configuration calls a group.
    ///
    /// # Panics
    /// If there is no such group.
    #[must_use]
    pub(crate) fn name(&self, group: usize) -> &str {
        &self.names[group]
    }
}
