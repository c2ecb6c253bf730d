use workbench::figures::{self, Table};

use crate::choice::nine;
use crate::{OPTIONS, shipped, sized};

#[test]
fn the_pictures_show_each_motor_with_all_that_the_job_asks_of_it() {
    let (report, _) = sized(&shipped("cartesian"), &nine(), &OPTIONS);
    let drawn = figures::sized(&report).unwrap().figures;
    let stems: Vec<&str> = drawn.iter().map(|figure| figure.table.stem.as_str()).collect();
    assert_eq!(stems, ["size_x_now", "size_x_chosen", "size_y_now", "size_y_chosen"]);
    for figure in &drawn {
        assert!(figure.svg.contains("speed [rpm]") && figure.svg.contains("torque [mN·m]"));
        assert!(figure.title.contains("ratio 3"), "{}", figure.title);
    }
    let most = |table: &Table, column: &str| {
        table.column(column).unwrap().into_iter().fold(0.0, |most: f64, it| most.max(it.abs()))
    };
    for (axis, pair) in report.axes.iter().zip(drawn.chunks(2)) {
        // The machine's motor does what the report says it must.
        let now = &pair[0].more[0];
        assert_eq!(most(now, "torque"), axis.need.demand.torque_peak);
        assert_eq!(most(now, "speed"), axis.need.demand.speed_peak);
        // The chosen one has a margin to its largest torque and to its speed without load.
        let [points, gives] = [&pair[1].more[0], &pair[1].table];
        assert_eq!(points.rows.len(), now.rows.len());
        assert!(OPTIONS.margin * most(points, "torque") <= most(gives, "torque_current"));
        assert!(OPTIONS.margin * most(points, "speed") <= most(gives, "speed"));
    }
}
