//! Why a value of the source is not what comes out: the errata by their names in `docs/errata.md`.

use schemars::JsonSchema;
use serde::Serialize;

/// An erratum, and what it changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Erratum {
    /// Its name, such as `E-3.17`.
    pub id: &'static str,
    /// What is printed, and what is right.
    pub text: &'static str,
}

/// All of them, in the order of the source.
pub const ERRATA: [Erratum; 28] = [
    Erratum {
        id: "E-3.1t",
        text: "no single way of marking that the source describes gives the times of table 3-1; here each line has a run-in from rest and a run-out to rest",
    },
    Erratum {
        id: "E-3.1v",
        text: "S at 2 cm is marked with 0.06 m/s in tables 3-2 and 4-1, not with the 0.05 m/s of table 3-1",
    },
    Erratum {
        id: "E-3.17",
        text: "C = m·ẍ·lead lacks 1/2π and 1/gear: C = m·ẍ·p with p per radian of the motor; 0.0989 N·m is not even the printed formula's value",
    },
    Erratum {
        id: "E-3.30",
        text: "the axial and the torsional spring of a screw stand in series, both seen in rotation, not in parallel",
    },
    Erratum {
        id: "E-3.5k", text: "2.626 N/m, the stiffness of a screw, is probably 2626 N·m/rad"
    },
    Erratum { id: "E-m1", text: "the parts of m1 add up to 1.794 kg, not to 1.93 kg" },
    Erratum {
        id: "E-4.2",
        text: "a breaking load of 600 N is 300 N by the belt's own section and stress; the table's title says screw",
    },
    Erratum {
        id: "E-4.15",
        text: "15 N/mm is one span of one belt; each direction has two spans of two belts, 60 N/mm",
    },
    Erratum { id: "E-4.5", text: "the CoreXY's 0.0173 N·m lacks the ½ of eq. 4.7: 0.00869 N·m" },
    Erratum {
        id: "E-vec",
        text: "the source accelerates x and y with 10 m/s² at once; here 10 m/s² is the length of the vector",
    },
    Erratum {
        id: "E-5.3",
        text: "the Jacobian of the 5R lacks the factor b, and has (X + e) for (X − e) in its second row; 5.6 follows from it",
    },
    Erratum { id: "E-5.11", text: "2/m_e is m_e/2" },
    Erratum {
        id: "E-5.20",
        text: "K = 2EJ/L of a bending arm, and the values of tables 5-4 and 6-4, agree with no load case: 3EJ/L for a force at the tip of a clamped arm",
    },
    Erratum { id: "E-e", text: "the distance of the 5R's motors is not printed; 100 mm here" },
    Erratum {
        id: "E-6.1",
        text: "where on the \"assi impropri\" the letters are drawn is not printed; at x = 212 mm here, where the links are at right angles",
    },
    Erratum {
        id: "E-6.area",
        text: "the \"assi impropri\" have 24 cm from 0.1 L to 0.9 L, but near both ends the tool is too slow or too weak in one direction; the machine file has 14 cm",
    },
    Erratum {
        id: "E-6.3",
        text: "signs and factors of the Jacobian of the \"assi impropri\", 6.3 to 6.5 and 6.10",
    },
    Erratum { id: "E-6.7", text: "the dynamics of the \"assi impropri\" leave the carts out" },
    Erratum {
        id: "E-6.5k", text: "2.673 N/m, the stiffness of a screw, is probably 2673 N·m/rad"
    },
    Erratum {
        id: "E-6.4k",
        text: "440 N·m/rad is that of a bending link; the links of the \"assi impropri\" are hinged at both ends, so nothing bends at the carts, and the screw yields",
    },
    Erratum {
        id: "E-7i",
        text: "the gear of 250 : 1 is only computed, the one that is built has 236.09 : 1",
    },
    Erratum { id: "E-7w", text: "2053 rpm is not the largest of table 5-2, which is 2100 rpm" },
    Erratum { id: "E-7row", text: "the row \"C·η\" holds C/η" },
    Erratum {
        id: "E-7eta",
        text: "the CoreXY's 0.0247 N·m is 0.0173 N·m/0.7, its own efficiency is 0.8: 0.0216 N·m",
    },
    Erratum {
        id: "E-7p",
        text: "P_max is the largest torque times the largest speed, which do not occur at one instant",
    },
    Erratum {
        id: "E-7m",
        text: "the masses of the 5R and of the \"assi impropri\" are not the sums of their parts: 1.218 kg for 1.31 kg, 1.384 kg for 1.22 kg",
    },
    Erratum {
        id: "E-area",
        text: "20 cm by 20 cm is not within the 5R's reach: a corner is 0.455 m from the far motor, and the arms are 0.45 m long",
    },
    Erratum {
        id: "E-size",
        text: "the sizes are indicative, read off a model of the bodies; here it is the box around joints and tool",
    },
];
