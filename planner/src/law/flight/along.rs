//! How far to go along one Newton step.

/// Where the quadratic `square`, positive at 0, first becomes 0.
pub(super) fn leave(square: &[f64; 3]) -> f64 {
    let [at, slope, curve] = *square;
    let discriminant = slope * slope - 4.0 * curve * at;
    if discriminant < 0.0 || (slope >= 0.0 && curve >= 0.0) {
        return f64::INFINITY;
    }
    // The least positive root, without cancellation.
    let root = 2.0 * at / (discriminant.sqrt() - slope);
    if root > 0.0 { root } else { f64::INFINITY }
}

/// The length in (0, `top`) at which the barrier of `squares` with `slope` has its least.
pub(super) fn along(squares: &[[f64; 3]], slope: f64, top: f64) -> f64 {
    let (mut low, mut high) = (0.0, top);
    let mut length = (0.9 * top).min(1.0);
    for _ in 0..6 {
        let (mut first, mut second) = (slope, 0.0);
        for [at, linear, curve] in squares {
            let value = at + (linear + curve * length) * length;
            let rate = (linear + 2.0 * curve * length) / value;
            first -= rate;
            second += rate * rate - 2.0 * curve / value;
        }
        if first > 0.0 {
            high = length
        } else {
            low = length
        }
        let next = length - first / second;
        let inside = next > low && next < high && next.is_finite();
        let next = if inside { next } else { (low + high.min(2.0 * length + low)) / 2.0 };
        if (next - length).abs() < 0.1 * length {
            return if inside { next } else { low };
        }
        length = next;
    }
    low.max(0.0)
}
