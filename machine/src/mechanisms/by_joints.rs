//! All mechanisms with one count of joints as one type.
//!
//! What is generic over the mechanism - planner, controller, plant, analyses - is compiled once for each
//! count of joints, not once for each mechanism. Which one it is, each call asks: nanoseconds beside the
//! mathematics.

/// For a branch or chain that another mechanism made: they come from the mechanism that they are handed
/// to, so that there is none.
#[cold]
pub(super) fn of_another() -> ! {
    unreachable!("a branch or a chain of another mechanism")
}

/// An enum of the mechanisms with `$joints` joints that is itself a mechanism, its branches and its solved
/// chains.
macro_rules! by_joints {
    ($joints:literal, $any:ident, $branch:ident, $chain:ident:
     $( $variant:ident: $mechanism:ty; )*) => {
        /// Any mechanism with this count of joints.
        #[allow(clippy::large_enum_variant, reason = "a stage has one of them")]
        #[derive(Debug, Clone)]
        enum $any {
            $( $variant($mechanism), )*
        }

        /// A branch of it.
        #[derive(Debug, Clone, Copy, PartialEq)]
        enum $branch {
            $( $variant(<$mechanism as Mechanism<$joints>>::Branch), )*
        }

        /// Its solved chain.
        #[allow(clippy::large_enum_variant, reason = "it is copied without an allocation")]
        #[derive(Debug, Clone, Copy)]
        enum $chain {
            $( $variant(<$mechanism as Mechanism<$joints>>::ChainState), )*
        }

        impl Branch for $branch {
            fn choices(&self) -> Vec<(&'static str, Vec<i32>)> {
                match self {
                    $( Self::$variant(branch) => branch.choices(), )*
                }
            }

            fn choose(self, name: &str, values: &[i32]) -> Option<Self> {
                match self {
                    $( Self::$variant(branch) => branch.choose(name, values).map(Self::$variant), )*
                }
            }

            fn in_any_turn(self) -> Self {
                match self {
                    $( Self::$variant(branch) => Self::$variant(branch.in_any_turn()), )*
                }
            }
        }

        #[allow(unreachable_patterns, reason = "of a count of joints there may be one mechanism")]
        impl Mechanism<$joints> for $any {
            type Branch = $branch;
            type ChainState = $chain;

            fn name(&self) -> &'static str {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::name(any)
                    } )*
                }
            }

            fn task_space(&self) -> TaskSpace {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::task_space(any)
                    } )*
                }
            }

            fn branch(&self) -> $branch {
                match self {
                    $( Self::$variant(any) => {
                        $branch::$variant(Mechanism::branch(any))
                    } )*
                }
            }

            fn solve(
                &self,
                q: &Joints<$joints>,
                branch: $branch,
                near: Option<&$chain>,
            ) -> Result<$chain, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        let near = near.and_then(|near| match near {
                            $chain::$variant(near) => Some(near),
                            _ => None,
                        });
                        Mechanism::solve(any, q, branch, near).map($chain::$variant)
                    } )*
                    _ => of_another(),
                }
            }

            fn solve_at(
                &self,
                pose: &Pose,
                q: &Joints<$joints>,
                branch: $branch,
                near: Option<&$chain>,
            ) -> Result<$chain, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        let near = near.and_then(|near| match near {
                            $chain::$variant(near) => Some(near),
                            _ => None,
                        });
                        Mechanism::solve_at(any, pose, q, branch, near).map($chain::$variant)
                    } )*
                    _ => of_another(),
                }
            }

            fn pose(&self, chain: &$chain) -> Pose {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::pose(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn branch_of(&self, chain: &$chain) -> $branch {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        $branch::$variant(Mechanism::branch_of(any, chain))
                    } )*
                    _ => of_another(),
                }
            }

            fn jacobian(&self, chain: &$chain) -> Jacobian<$joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::jacobian(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn tool_turning(&self, chain: &$chain) -> SMatrix<f64, 3, $joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::tool_turning(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn wrench_efforts(&self, chain: &$chain, wrench: &Vector6<f64>) -> Joints<$joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::wrench_efforts(any, chain, wrench)
                    } )*
                    _ => of_another(),
                }
            }

            fn margins(&self, chain: &$chain) -> Vec<Margin> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::margins(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn forward(&self, q: &Joints<$joints>, branch: $branch) -> Result<Pose, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        Mechanism::forward(any, q, branch)
                    } )*
                    _ => of_another(),
                }
            }

            fn locate(
                &self,
                q: &Joints<$joints>,
                branch: $branch,
                near: Option<&$chain>,
            ) -> Result<Pose, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        let near = near.and_then(|near| match near {
                            $chain::$variant(near) => Some(near),
                            _ => None,
                        });
                        Mechanism::locate(any, q, branch, near)
                    } )*
                    _ => of_another(),
                }
            }

            fn inverse(
                &self,
                pose: &Pose,
                branch: $branch,
                previous: &Joints<$joints>,
            ) -> Result<Joints<$joints>, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        Mechanism::inverse(any, pose, branch, previous)
                    } )*
                    _ => of_another(),
                }
            }

            fn joint_motion(
                &self,
                tool: &ToolMotion,
                branch: $branch,
                previous: &Joints<$joints>,
            ) -> Result<JointMotion<$joints>, KinematicsError> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        Mechanism::joint_motion(any, tool, branch, previous)
                    } )*
                    _ => of_another(),
                }
            }

            fn inverse_machine_angles(
                &self,
                position: &Vector3<f64>,
                angles: [f64; 2],
                branch: $branch,
                previous: &Joints<$joints>,
            ) -> Option<Result<Joints<$joints>, KinematicsError>> {
                match (self, branch) {
                    $( (Self::$variant(any), $branch::$variant(branch)) => {
                        Mechanism::inverse_machine_angles(any, position, angles, branch, previous)
                    } )*
                    _ => of_another(),
                }
            }

            fn mass_matrix(&self, chain: &$chain) -> SMatrix<f64, $joints, $joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::mass_matrix(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn bias(&self, chain: &$chain, velocity: &Joints<$joints>) -> Joints<$joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::bias(any, chain, velocity)
                    } )*
                    _ => of_another(),
                }
            }

            fn gravity(&self, chain: &$chain) -> Joints<$joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::gravity(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn has_constant_mass(&self) -> bool {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::has_constant_mass(any)
                    } )*
                }
            }

            fn is_linear(&self) -> bool {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::is_linear(any)
                    } )*
                }
            }

            fn bodies(&self, chain: &$chain) -> Bodies {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::bodies(any, chain)
                    } )*
                    _ => of_another(),
                }
            }

            fn stiffness(&self) -> Option<SMatrix<f64, $joints, $joints>> {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::stiffness(any)
                    } )*
                }
            }

            fn damping(&self) -> SMatrix<f64, $joints, $joints> {
                match self {
                    $( Self::$variant(any) => {
                        Mechanism::damping(any)
                    } )*
                }
            }

            fn inverse_dynamics(
                &self,
                chain: &$chain,
                velocity: &Joints<$joints>,
                acceleration: &Joints<$joints>,
            ) -> Joints<$joints> {
                match (self, chain) {
                    $( (Self::$variant(any), $chain::$variant(chain)) => {
                        Mechanism::inverse_dynamics(any, chain, velocity, acceleration)
                    } )*
                    _ => of_another(),
                }
            }
        }
    };
}
pub(super) use by_joints;
