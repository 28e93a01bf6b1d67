//! Words of columns' names, in the languages that tables were found in; a list is separated by spaces.

/// What distances are called.
pub const DISTANCE: &str = "l distance dist length len abstand distanz länge laenge longueur 距离 长度";

/// What joints are called.
pub const JOINT: &str = "j q joint joints theta θ th axis ax a jnt jt jointangle jointpos jointposition angle gelenk achse \
    articulation axe 关节 关节角 关节角度 轴";

/// Words beside a joint's name or a coordinate's that say nothing new.
pub const PLAIN: &str = "angle angles pos position positions value values coord coordinate coordinates p point state reading \
    xyz in koordinate koordinaten 坐标 位置 角度";

/// Words that say that a number is something else.
pub const ELSE: &str = "tau torque torques force f current effort i vel velocity speed v qd dq acc temp temperature dif diff delta \
    err error errors e res residual residuals dev deviation std sd sigma unc uncertainty u rms var cov \
    rot rotation rvec rotvec roll pitch yaw euler quat quaternion orientation offset normal min";

/// Of a point that was commanded or computed.
pub const COMMANDED: &str = "cmd command commanded nominal nom n t target goal desired des d ref reference set setpoint plan \
    planned program prog controller pred predicted theo theoretical ideal taught programmed fk calc calculated computed c model robot soll theorie consigne \
    理论 名义 指令 期望 目标 规划 理想 计算 命令";

/// Of one that was measured, or that a controller says it was.
pub const MEASURED: &str = "m meas measure measured measurement act actual observed obs real ist gemessen mesure mesurée mesuré \
    实际 实测 测量";

/// What only an instrument's points are called.
pub const INSTRUMENT: &str = "laser tracker lt leica faro smr camera vicon ndi mocap cmm marker reflector 激光 跟踪仪";

/// Of a point that a controller computed from its encoders.
pub const ENCODER: &str = "encoder encoders";

/// What is true beside anything that is measured.
pub const TRUTH: &str = "gt truth groundtruth true";

/// What is an instrument's, or where the robot was sent, beside what a controller calls so.
pub const REFERENCE: &str = "ref reference";
pub const CONTROLLER: &str = "act actual real";

/// Units that are not read: a column in one of them is none in degrees or mm.
pub const UNREAD: &str = "gon gons gradian gradians mrad urad µrad μrad arcmin arcsec rev revs turns count counts pulse pulses ticks dm km nm \
    ft foot feet mil mils thou";

/// Whether a list has this word.
pub fn is_in(list: &str, word: &str) -> bool {
    list.split_whitespace().any(|listed| listed == word)
}
