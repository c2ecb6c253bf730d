//! Backlash: what a motor turns before its load feels it.
//!
//! Each joint's transmission is a spring behind a gap. In the gap it carries nothing; beyond, it is
//! wound by what is left of the way. Springs that couple the joints pull at each other's ends: each
//! end then stands at that place in its gap at which all of them together hold the least energy. An
//! end that touches neither side carries nothing there.

use nalgebra::{SMatrix, SVector};

/// Rounds that settle springs which couple the joints; uncoupled ones are right after the first.
const ROUNDS: usize = 60;

/// How far the springs are wound [m or rad], with the motors ahead of the load by `ahead` [joint
/// units], each with a gap of `half` a backlash to either side, and springs of `stiffness`.
///
/// `stiffness` must be positive definite, as that of a transmission is.
pub fn wound<const N: usize>(
    stiffness: &SMatrix<f64, N, N>,
    ahead: &SVector<f64, N>,
    half: &SVector<f64, N>,
) -> SVector<f64, N> {
    let mut wound = SVector::from_fn(|joint, _| past_gap(ahead[joint], half[joint]));
    for _ in 0..ROUNDS {
        let before = wound;
        for joint in 0..N {
            let own = stiffness[(joint, joint)];
            let others = (stiffness.row(joint) * wound)[0] - own * wound[joint];
            let (from, to) = (ahead[joint] - half[joint], ahead[joint] + half[joint]);
            // Not `clamp`, which panics at bounds that are no numbers.
            wound[joint] = (-others / own).max(from).min(to);
        }
        if wound == before {
            break;
        }
    }
    wound
}

/// What is left of `ahead` beyond a gap of `half` to either side.
fn past_gap(ahead: f64, half: f64) -> f64 {
    if ahead > half {
        ahead - half
    } else if ahead < -half {
        ahead + half
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};

    #[test]
    fn nothing_is_felt_within_the_gap() {
        let stiffness = Matrix2::new(5.0, 0.0, 0.0, 7.0);
        let half = Vector2::new(0.1, 0.2);
        let wound = |x, y| wound(&stiffness, &Vector2::new(x, y), &half);
        assert_eq!(wound(0.1, -0.2), Vector2::zeros());
        assert_eq!(wound(0.25, -0.5), Vector2::new(0.25 - 0.1, -0.5 + 0.2));
    }

    /// A joint inside its gap carries nothing, even where the other one's spring pulls at it.
    #[test]
    fn coupled_springs_carry_nothing_where_an_end_is_free() {
        let stiffness = Matrix2::new(5.0, 3.0, 3.0, 7.0);
        let half = Vector2::new(0.5, 0.0);
        let wound = wound(&stiffness, &Vector2::new(0.1, 0.4), &half);
        let effort = stiffness * wound;
        assert_eq!(wound.y, 0.4);
        assert!(effort.x.abs() < 1e-12 && (wound.x - 0.1).abs() < 0.5, "{effort}");
        // Against its wall it carries what the wall holds.
        let wound = super::wound(&stiffness, &Vector2::new(1.0, 0.4), &half);
        assert_eq!(wound, Vector2::new(0.5, 0.4));
    }
}
