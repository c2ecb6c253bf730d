//! The passes over the rows of a block, some rows at once.

use super::program::{Group, LANES, Lanes};

/// The larger of two numbers; quicker than the standard one, which minds NaN.
pub(super) fn max(left: f64, right: f64) -> f64 {
    if left > right { left } else { right }
}

/// Sums over the rows of a block.
#[derive(Default)]
pub(super) struct Sums {
    pub(super) complement: Lanes,
    pub(super) off: Lanes,
    pub(super) squares: [Lanes; 3],
    pub(super) beside: [Lanes; 2],
    pub(super) beyond: Lanes,
    pub(super) side: [Lanes; 3],
    pub(super) priced: [Lanes; 3],
    /// Σ price, and Σ price · top.
    pub(super) prices: Lanes,
    pub(super) worth: Lanes,
}

impl Sums {
    /// Takes the group's last step and adds its rows at the unknowns `y`.
    #[inline]
    pub(super) fn take(&mut self, group: &mut Group, y: [f64; 3], stride: (f64, f64)) {
        for lane in 0..LANES {
            let weights = [group.weights[0][lane], group.weights[1][lane], group.weights[2][lane]];
            let room = group.room[lane] + stride.0 * group.room_step[lane];
            let price = group.price[lane] + stride.1 * group.price_step[lane];
            let used = weights[0] * y[0] + weights[1] * y[1] + weights[2] * y[2];
            let off = group.top[lane] - used - room;
            let ratio = price / room;
            group.room[lane] = room;
            group.price[lane] = price;
            group.off[lane] = off;
            group.ratio[lane] = ratio;
            self.complement[lane] += room * price;
            self.prices[lane] += price;
            self.worth[lane] += price * group.top[lane];
            self.off[lane] = max(self.off[lane], off.abs());
            let scaled = [ratio * weights[0], ratio * weights[1], ratio * weights[2]];
            self.squares[0][lane] += scaled[0] * weights[0];
            self.squares[1][lane] += scaled[1] * weights[1];
            self.squares[2][lane] += scaled[2] * weights[2];
            self.beside[0][lane] += scaled[0] * weights[1];
            self.beside[1][lane] += scaled[1] * weights[2];
            self.beyond[lane] += scaled[0] * weights[2];
            for k in 0..3 {
                self.side[k][lane] += scaled[k] * off;
                self.priced[k][lane] += price * weights[k];
            }
        }
    }
}

/// What the step without centring does.
#[derive(Default)]
pub(super) struct Predicted {
    /// Σ room·price, Σ room step·price, Σ room·price step, Σ of the product of the steps.
    sums: [Lanes; 4],
    room: Lanes,
    dear: Lanes,
}

impl Predicted {
    /// Adds the bound of one unknown.
    pub(super) fn scalar(&mut self, room: f64, price: f64, room_step: f64, price_step: f64) {
        self.sums[0][0] += room * price;
        self.sums[1][0] += room_step * price;
        self.sums[2][0] += room * price_step;
        self.sums[3][0] += room_step * price_step;
        self.room[0] = max(self.room[0], -room_step / room);
        self.dear[0] = max(self.dear[0], -price_step / price);
    }

    /// Adds the rows of a group for the `step` of the unknowns.
    #[inline]
    pub(super) fn take(
        &mut self,
        group: &mut Group,
        step: [f64; 3],
        side: &mut [Lanes; 3],
        centre: &mut [Lanes; 3],
    ) {
        for lane in 0..LANES {
            let weights = [group.weights[0][lane], group.weights[1][lane], group.weights[2][lane]];
            let (room, price) = (group.room[lane], group.price[lane]);
            let used = weights[0] * step[0] + weights[1] * step[1] + weights[2] * step[2];
            let room_step = group.off[lane] - used;
            let inverse = 1.0 / room;
            // The price falls by its own part and as the room grows.
            let part = room_step * inverse;
            let price_step = -price - price * part;
            self.sums[0][lane] += room * price;
            self.sums[1][lane] += room_step * price;
            self.sums[2][lane] += room * price_step;
            let cross = room_step * price_step;
            self.sums[3][lane] += cross;
            self.room[lane] = max(self.room[lane], -part);
            self.dear[lane] = max(self.dear[lane], 1.0 + part);
            group.cross[lane] = cross;
            for k in 0..3 {
                side[k][lane] += weights[k] * cross * inverse;
                centre[k][lane] += weights[k] * inverse;
            }
        }
    }

    /// The complement after the longest step.
    pub(super) fn after(&self) -> f64 {
        let longest = |most: Lanes| {
            let most = most.iter().fold(0.0_f64, |most, lane| most.max(*lane));
            (1.0 / most.max(1e-300)).min(1.0)
        };
        let (room, dear) = (longest(self.room), longest(self.dear));
        let sum = |k: usize| self.sums[k].iter().sum::<f64>();
        (sum(0) + room * sum(1) + dear * sum(2) + room * dear * sum(3)).max(0.0)
    }
}
