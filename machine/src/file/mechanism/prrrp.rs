//! The table of a PRRRP.

use super::chain::{self, sign};
use super::{BuildContext, Built};
use crate::document::{Diagnostics, NonNegative, Number, Positive, Quantity};
use crate::file::axes::JointUnit;
use crate::mechanisms::MechanismKind;
use crate::mechanisms::prrrp::{Prrrp, PrrrpBranch};
use crate::quantity as unit;
use crate::table;

type Above<K> = Quantity<K, Positive>;

table! {
    /// Two carts on one rail along y, and a link from each to the tool. Its axes are `p1` and `p2`,
    /// the carts' places on the rail.
    pub struct PrrrpTable {
        /// Length of a link (L of the source).
        pub link: Above<unit::Length>,
        /// Mass of a link, its centre in the middle.
        pub link_mass: Above<unit::Mass>,
        /// Inertia of a link about its centre of mass.
        pub link_inertia: Above<unit::Inertia>,
        /// Mass of a cart.
        pub cart_mass: Above<unit::Mass>,
        /// Mass of the tool.
        pub tool_mass: Above<unit::Mass>,
        /// Mass of a bar that guides the tool and moves in y only.
        pub bar_mass: Quantity<unit::Mass, NonNegative> = "0 kg",
        /// 1 with the tool at positive x, −1 at negative x.
        pub side: Number = 1.0,
        /// Smallest half distance of the carts, as a share of a link.
        pub type_1_margin: Number<Positive> = 0.05,
        /// Smallest distance of the tool from the rail, as a share of a link.
        pub type_2_margin: Number<Positive> = 0.1,
    }
}

pub(super) fn build(
    table: &PrrrpTable,
    context: &BuildContext<'_>,
    diagnostics: &mut Diagnostics,
) -> Option<Built> {
    let mut mechanism = Prrrp {
        link: table.link.value,
        link_mass: table.link_mass.value,
        link_inertia: table.link_inertia.value,
        cart_mass: table.cart_mass.value,
        tool_mass: table.tool_mass.value,
        bar_mass: table.bar_mass.value,
        type_1_limit: table.type_1_margin.value,
        type_2_limit: table.type_2_margin.value,
        branch: PrrrpBranch { side: sign(&table.side, diagnostics) },
        elasticity: None,
    };
    let names = [("p1", JointUnit::Length), ("p2", JointUnit::Length)];
    let (joints, elasticity, home) = chain::joints(&mechanism, names, context, diagnostics)?;
    mechanism.elasticity = elasticity;
    Some(Built { mechanism: MechanismKind::Prrrp(mechanism), joints, home })
}
