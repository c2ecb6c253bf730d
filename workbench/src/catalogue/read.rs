//! From the tables of a catalogue to its entries.

use super::bounds::bounds;
use super::table::{
    CatalogueBeltTable, CatalogueGearTable, CatalogueMotorTable, CatalogueScrewTable,
    CatalogueTable, ThermalTable,
};
use super::{
    Belt, Catalogue, CatalogueGear, CatalogueMotor, Screw, ServiceFactor, Supply, Thermal,
};
use machine::Motor;
use machine::document::{Diagnostics, Document, DocumentError, ProblemKind, Span, Spanned};
use machine::file::motors;

/// The entries of `document`.
pub(super) fn catalogue(document: Document) -> Result<Catalogue, DocumentError> {
    let (table, mut diagnostics) = document.decode_within::<CatalogueTable>(bounds())?;
    let CatalogueTable { source, motor, gear, screw, belt, supply, span: _ } = &table;
    let motors = motor.as_deref().unwrap_or(&[]);
    let gears = gear.as_deref().unwrap_or(&[]);
    unique("motors", motors.iter().map(|motor| &motor.name), &mut diagnostics);
    unique("gears", gears.iter().map(|gear| &gear.name), &mut diagnostics);
    let screws = screw.as_deref().unwrap_or(&[]);
    let belts = belt.as_deref().unwrap_or(&[]);
    unique("screws", screws.iter().map(|screw| &screw.axis), &mut diagnostics);
    unique("belts", belts.iter().map(|belt| &belt.axis), &mut diagnostics);
    let source = source.as_ref();
    let catalogue = Catalogue {
        motors: motors.iter().filter_map(|it| read_motor(it, source, &mut diagnostics)).collect(),
        gears: gears.iter().filter_map(|it| read_gear(it, source, &mut diagnostics)).collect(),
        screws: screws.iter().map(|it| read_screw(it, &mut diagnostics)).collect(),
        belts: belts.iter().map(|it| read_belt(it, &mut diagnostics)).collect(),
        supply: supply.as_ref().map(|supply| Supply {
            capacitance: supply.capacitance.value,
            max_voltage: supply.max_voltage.value,
        }),
    };
    diagnostics.finish(catalogue)
}

/// Refuses `names` that are there twice.
fn unique<'a>(
    what: &str,
    names: impl Iterator<Item = &'a Spanned<String>>,
    diagnostics: &mut Diagnostics,
) {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if seen.contains(&name.value.as_str()) {
            diagnostics.contradict(
                name.span,
                format!("two {what} are of the name `{}`", name.value),
                "give each its own name",
            );
        }
        seen.push(&name.value);
    }
}

/// The source of an entry called `name`; refused where there is none.
fn source_of(
    own: Option<&Spanned<String>>,
    common: Option<&Spanned<String>>,
    name: &Spanned<String>,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    let source = own.or(common).filter(|source| !source.value.trim().is_empty());
    if source.is_none() {
        diagnostics.refuse(
            ProblemKind::MissingKey,
            name.span,
            format!("`{}` names no source of its data", name.value),
            Some(
                "add `source = \"data sheet and date\"` to it, or once at the top of the file"
                    .to_owned(),
            ),
        );
    }
    source.map(|source| source.value.clone())
}

fn read_motor(
    table: &CatalogueMotorTable,
    source: Option<&Spanned<String>>,
    diagnostics: &mut Diagnostics,
) -> Option<CatalogueMotor> {
    let name = &table.name;
    let source = source_of(table.source.as_ref(), source, name, diagnostics);
    let motor = match (&table.dc, &table.stepper) {
        (Some(data), None) => Motor::Dc(motors::dc(data, 0.0, diagnostics)),
        (None, Some(data)) => Motor::Stepper(motors::stepper(data, 0.0, diagnostics)),
        (dc, _) => {
            let (problem, kind) = match dc {
                Some(_) => ("is both a DC motor and a stepper", ProblemKind::Contradiction),
                None => ("is neither a DC motor nor a stepper", ProblemKind::MissingKey),
            };
            diagnostics.refuse(
                kind,
                name.span,
                format!("`{}` {problem}", name.value),
                Some("give it one table, [motor.dc] or [motor.stepper]".to_owned()),
            );
            return None;
        }
    };
    let thermal = table.thermal.as_ref().map(|table| read_thermal(table, diagnostics));
    Some(CatalogueMotor {
        name: name.value.clone(),
        maker: table.maker.as_ref().map(|maker| maker.value.clone()),
        source: source?,
        mass: table.mass.map(|mass| mass.value),
        max_speed: table.max_speed.map(|speed| speed.value),
        no_load_current: table.no_load_current.map_or(0.0, |current| current.value),
        thermal,
        motor,
    })
}

fn read_thermal(table: &ThermalTable, diagnostics: &mut Diagnostics) -> Thermal {
    if table.winding_time.is_some() != table.motor_time.is_some() {
        diagnostics.contradict(
            table.span,
            "`winding_time` and `motor_time` only say something together".to_owned(),
            "give both or none",
        );
    }
    let times = table.winding_time.zip(table.motor_time);
    Thermal {
        winding_housing: table.winding_housing.value,
        housing_ambient: table.housing_ambient.value,
        times: times.map(|(winding, motor)| [winding.value, motor.value]),
        max_winding: table.max_winding.map(|most| most.value),
    }
}

fn read_gear(
    table: &CatalogueGearTable,
    source: Option<&Spanned<String>>,
    diagnostics: &mut Diagnostics,
) -> Option<CatalogueGear> {
    let source = source_of(table.source.as_ref(), source, &table.name, diagnostics);
    if let Some(continuous) = table.continuous_torque
        && continuous.value > table.max_torque.value
    {
        diagnostics.contradict(
            continuous.span,
            format!(
                "the continuous torque of {} N·m is above the largest of {} N·m",
                continuous.value, table.max_torque.value
            ),
            "lower `continuous_torque`, or raise `max_torque`",
        );
    }
    Some(CatalogueGear {
        name: table.name.value.clone(),
        source: source?,
        ratio: table.ratio.value,
        efficiency: table.efficiency.value,
        static_efficiency: table.static_efficiency.value,
        max_torque: table.max_torque.value,
        continuous_torque: table.continuous_torque.map(|torque| torque.value),
        mass: table.mass.map(|mass| mass.value),
        inertia: table.inertia.value,
        max_input_speed: table.max_input_speed.map(|speed| speed.value),
        loads: [table.radial_load, table.axial_load].map(|load| load.map(|load| load.value)),
        service: ServiceFactor {
            uniform: table.service_factor.uniform.value,
            medium: table.service_factor.medium.value,
            heavy: table.service_factor.heavy.value,
        },
    })
}

fn read_screw(table: &CatalogueScrewTable, diagnostics: &mut Diagnostics) -> Screw {
    refuse_wide_bore(table, table.bore.span, diagnostics);
    Screw {
        axis: table.axis.value.clone(),
        diameter: table.diameter.value,
        bore: table.bore.value,
        length: table.length.value,
        support: table.support.value,
        modulus: table.modulus.value,
        density: table.density.value,
    }
}

fn refuse_wide_bore(table: &CatalogueScrewTable, span: Span, diagnostics: &mut Diagnostics) {
    if table.bore.value >= table.diameter.value {
        diagnostics.contradict(
            span,
            "the bore is as wide as the screw".to_owned(),
            "a bore is narrower than `diameter`",
        );
    }
}

fn read_belt(table: &CatalogueBeltTable, diagnostics: &mut Diagnostics) -> Belt {
    if table.friction.is_some() != table.wrap.is_some() {
        diagnostics.contradict(
            table.span,
            "`friction` and `wrap` only say something together".to_owned(),
            "give both, or none for a toothed belt",
        );
    }
    let grip = table.friction.zip(table.wrap);
    Belt {
        axis: table.axis.value.clone(),
        breaking_force: table.breaking_force.map(|force| force.value),
        grip: grip.map(|(friction, wrap)| [friction.value, wrap.value]),
    }
}
