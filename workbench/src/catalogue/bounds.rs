//! Which values the quantities of a catalogue can have; those that a machine file has too have its bounds.

use machine::document::Bounds;
use machine::file::bounds::BOUNDS;
use std::sync::LazyLock;

const fn row(
    keys: &'static [&'static str],
    possible: [&'static str; 2],
    usual: [&'static str; 2],
    reason: &'static str,
) -> Bounds {
    Bounds { keys, possible, usual, reason }
}

/// The bounds of what only a catalogue has.
#[rustfmt::skip]
pub(super) const OWN: &[Bounds] = &[
    row(&["CatalogueMotorTable.mass", "CatalogueGearTable.mass"],
        ["1e-6 kg", "1e5 kg"], ["0.5 g", "200 kg"],
        "motors of 4 mm have 1 g, of 20 kW 150 kg"),
    row(&["CatalogueMotorTable.max_speed", "CatalogueGearTable.max_input_speed"],
        ["0.01 rpm", "1e6 rpm"], ["10 rpm", "1e5 rpm"],
        "from torque motors to spindles"),
    row(&["CatalogueMotorTable.no_load_current"],
        ["0 A", "1e6 A"], ["0 A", "50 A"],
        "some per cent of what the winding bears"),
    row(&["ThermalTable.winding_housing", "ThermalTable.housing_ambient"],
        ["1e-4", "1e4"], ["0.01", "300"],
        "motors of 6 mm have 100 K/W, of 10 kW some hundredths"),
    row(&["ThermalTable.winding_time", "ThermalTable.motor_time"],
        ["1 ms", "1e6 s"], ["0.5 s", "20000 s"],
        "the winding of a motor of 6 mm warms in a second, a motor of 10 kW in some hours"),
    row(&["ThermalTable.max_winding"],
        ["30", "500"], ["60", "220"],
        "varnish of class A stands 105, of class H 180 degrees Celsius"),
    row(&["CatalogueGearTable.ratio"],
        ["1e-4", "1e6"], ["0.1", "10000"],
        "planetary gears of five stages step down to some thousand"),
    row(&["CatalogueGearTable.efficiency", "CatalogueGearTable.static_efficiency"],
        ["0.001", "1"], ["0.2", "1"],
        "a worm of many turns passes on a third"),
    row(&["CatalogueGearTable.max_torque", "CatalogueGearTable.continuous_torque"],
        ["1e-7 N m", "1e7 N m"], ["1e-4 N m", "1e5 N m"],
        "gears of 4 mm bear 2 mN m, of robots 1e4 N m"),
    row(&["CatalogueGearTable.inertia"],
        ["0 kg m^2", "1e3 kg m^2"], ["0 kg m^2", "0.1 kg m^2"],
        "some per cent of a rotor's"),
    row(&["CatalogueGearTable.radial_load", "CatalogueGearTable.axial_load"],
        ["1e-3 N", "1e8 N"], ["0.1 N", "1e6 N"],
        "plain bearings of 3 mm bear some newtons"),
    row(&["ServiceFactorTable.uniform", "ServiceFactorTable.medium", "ServiceFactorTable.heavy"],
        ["0.1", "10"], ["0.8", "3"],
        "gear makers ask for 1 to 2"),
    row(&["CatalogueScrewTable.diameter", "CatalogueScrewTable.length"],
        ["10 um", "100 m"], ["1 mm", "10 m"],
        "from parts of watches to the longest gantries"),
    row(&["CatalogueScrewTable.bore"],
        ["0 m", "10 m"], ["0 m", "0.2 m"],
        "0 of a solid screw"),
    row(&["CatalogueScrewTable.modulus"],
        ["1e3 N/m^2", "1e13 N/m^2"], ["1e9 N/m^2", "1e12 N/m^2"],
        "steel has 210 GPa"),
    row(&["CatalogueScrewTable.density"],
        ["10", "1e5"], ["1000", "20000"],
        "steel has 7850 kg/m^3"),
    row(&["CatalogueBeltTable.breaking_force"],
        ["1e-3 N", "1e8 N"], ["1 N", "1e6 N"],
        "a belt of 6 mm breaks at some 1000 N"),
    row(&["CatalogueBeltTable.friction"],
        ["1e-3", "10"], ["0.05", "1.5"],
        "leather on steel has 0.3, rubber up to 1"),
    row(&["CatalogueBeltTable.wrap"],
        ["1 deg", "10 rev"], ["30 deg", "2 rev"],
        "half a turn of two like pulleys"),
    row(&["SupplyTable.capacitance"],
        ["1e-9", "1e6"], ["1e-6", "100"],
        "power supplies have 1 mF"),
    row(&["SupplyTable.max_voltage"],
        ["0.1 V", "1e6 V"], ["1 V", "1200 V"],
        "from one battery cell to the link of a 690 V mains drive"),
];

/// The bounds of everything that a catalogue has.
pub(super) fn bounds() -> &'static [Bounds] {
    static ALL: LazyLock<Vec<Bounds>> = LazyLock::new(|| [OWN, BOUNDS].concat());
    &ALL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::table;

    #[test]
    fn every_row_can_be_read_and_its_usual_range_is_possible() {
        for Bounds { keys, possible, usual, reason } in OWN {
            let ranges = [possible, usual].map(|ends| Bounds::range(*ends));
            let [Some((possible, of)), Some((usual, in_same))] = ranges else {
                panic!("{keys:?} cannot be read")
            };
            assert_eq!(of, in_same, "{keys:?}");
            assert!(possible[0] <= usual[0] && usual[0] < usual[1] && usual[1] <= possible[1]);
            assert!(!reason.is_empty(), "{keys:?}");
        }
    }

    /// A key that is no number has no bounds, and every other of a catalogue has.
    #[test]
    fn every_number_of_a_catalogue_has_bounds() {
        let words = ["name", "maker", "source", "thermal", "dc", "stepper", "axis", "support"];
        for (name, fields) in [
            ("CatalogueMotorTable", table::CatalogueMotorTable::fields()),
            ("ThermalTable", table::ThermalTable::fields()),
            ("CatalogueGearTable", table::CatalogueGearTable::fields()),
            ("ServiceFactorTable", table::ServiceFactorTable::fields()),
            ("CatalogueScrewTable", table::CatalogueScrewTable::fields()),
            ("CatalogueBeltTable", table::CatalogueBeltTable::fields()),
            ("SupplyTable", table::SupplyTable::fields()),
        ] {
            for field in fields {
                let is_word = words.contains(&field.key) || field.key == "service_factor";
                let rows = OWN.iter().filter(|row| row.is_of(name, field.key)).count();
                assert_eq!(rows, usize::from(!is_word), "{name}.{}", field.key);
            }
        }
    }
}
