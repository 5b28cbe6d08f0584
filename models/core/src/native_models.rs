//! How the crates that hold built-in models list them: one list per family, and all families together.
//!
//! No model stands here: a family is a crate of its own, and whoever builds models says which families there are. Next file
//! to read: [`crate::model`].

use crate::layout;
use crate::{Model, ModelDef, SetupError};

/// One built-in model of a family's list.
#[derive(Clone, Copy, Debug)]
pub struct NativeModel {
    /// The `kind` by which a study names it.
    pub kind: &'static str,
    /// Makes it; without a layout, in its default one.
    pub build: fn(&ModelDef) -> Result<Box<dyn Model>, SetupError>,
    /// Whether its own step is a scheme that agrees with the integrated rate to an order only, which the model's own tests
    /// hold, and not to rounding.
    pub of_own_order: bool,
}

impl NativeModel {
    /// An entry for a model that has no layout.
    pub const fn fixed<M: Model + Default + 'static>(kind: &'static str) -> Self {
        Self::laid_out(kind, fixed::<M>)
    }

    /// An entry for a model that reads its layout.
    pub const fn laid_out(
        kind: &'static str,
        build: fn(&ModelDef) -> Result<Box<dyn Model>, SetupError>,
    ) -> Self {
        Self { kind, build, of_own_order: false }
    }

    /// The same for a model whose step is a scheme of an order of its own.
    #[must_use]
    pub const fn of_own_order(self) -> Self {
        Self { of_own_order: true, ..self }
    }
}

/// The built-in models of all families.
#[derive(Clone, Copy, Debug)]
pub struct NativeModels(&'static [&'static [NativeModel]]);

impl NativeModels {
    /// No model.
    pub const NONE: Self = Self(&[]);

    /// The lists of these families, in their order.
    pub const fn of(families: &'static [&'static [NativeModel]]) -> Self {
        Self(families)
    }

    /// Every entry.
    pub fn iter(self) -> impl Iterator<Item = &'static NativeModel> {
        self.0.iter().copied().flatten()
    }

    /// The entry of this kind.
    pub fn find(self, kind: &str) -> Option<&'static NativeModel> {
        self.iter().find(|native| native.kind == kind)
    }

    /// Every model in its default layout.
    ///
    /// # Errors
    /// When a model refuses its own default, which is a defect.
    pub fn all(self) -> Result<Vec<Box<dyn Model>>, SetupError> {
        self.iter()
            .map(|native| (native.build)(&ModelDef { kind: native.kind.to_owned(), ..ModelDef::default() }))
            .collect()
    }
}

/// Builds a model that has no layout.
fn fixed<M: Model + Default + 'static>(def: &ModelDef) -> Result<Box<dyn Model>, SetupError> {
    layout::none(def)?;
    Ok(Box::new(M::default()))
}
