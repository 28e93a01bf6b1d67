//! Every instruction that moves, in each language.

use super::{read, said};
use crate::programs::*;

const ELSEWHERE: &str = "moves by values that are not numbers in this file";

#[test]
fn rapid() {
    let text = r#"MODULE work
  CONST jointtarget jHome := [[0,-20,20,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jRow{2} := [[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]],
[[2,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PERS robtarget p10 := [[500,0,400],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR jointtarget jTurned := [[9,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];
  VAR jointtarget jEither;
  VAR jointtarget jNow;
  PROC main()
! MoveL p10, v100, fine, tool0;
TPWrite "MoveL p10, v100, fine, tool0; ! no comment";
MoveAbsJ \Conc, jHome\NoEOffs, v1000,
  fine, tool0;
jEither := jHome;
jTurned.robax.rax_1 := jTurned.robax.rax_1 + 5;
jNow := CJointT();
IF DI1 = 1 MoveL Offs(p10, 0, 0, 50), v100, z10, tool0\WObj:=wobj0;
IF nCount > 2 THEN MoveJ RelTool(p10, 0, 0, 10\Rz:=90), v100, z10, tool0; ENDIF
MoveAbsJ jRow{nCount}, vFast, zNear, tool0;
MoveAbsJ jEither, vFast, zNear, tool0;
MoveAbsJ jTurned, v100, fine, tool0;
MoveAbsJ jNow, v100, fine, tool0;
MoveAbsJ [[7,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]], v100, fine, tool0;
MoveC p1, p2, v100, z1, tool0;
SearchL \Stop, diTouch, pFound, p10, v50, tool0;
TriggL p10, v100, gun, z10, tool0;
ArcL p10, v100, seam, weld\Weave:=w, z10, tool0;
MoveExtJ jHome, vrot10, fine;
CutAlong p10, v100, z5, tool0;
moveLeft 10;
MoveAbsJ jOther, v100, fine, tool0;
  ENDPROC
  PROC go(jointtarget jTo) MoveAbsJ jTo, v100, fine, tool0; ENDPROC
  PROC moveLamp(num a, num b, num c) ENDPROC
ENDMODULE
"#;
    let expected = [
        "12 MoveAbsJ: jHome".to_owned(),
        "line 17: MoveL Offs(p10, 0, 0, 50) is Cartesian".to_owned(),
        "line 18: MoveJ RelTool(p10, 0, 0, 10\\Rz:=90) is Cartesian".to_owned(),
        "19 MoveAbsJ: line 3 line 4".to_owned(),
        "20 MoveAbsJ: jHome".to_owned(),
        format!("line 21: MoveAbsJ jTurned {ELSEWHERE}"),
        format!("line 22: MoveAbsJ jNow {ELSEWHERE}"),
        "23 MoveAbsJ: line 23".to_owned(),
        "line 24: MoveC p1 is Cartesian".to_owned(),
        "line 25: SearchL p10 is Cartesian".to_owned(),
        "line 26: TriggL p10 is Cartesian".to_owned(),
        "line 27: ArcL p10 is Cartesian".to_owned(),
        "line 28: MoveExtJ jHome moves external axes".to_owned(),
        "line 29: CutAlong p10 is an instruction that is not known here".to_owned(),
        format!("line 31: MoveAbsJ jOther {ELSEWHERE}"),
        format!("line 33: MoveAbsJ jTo {ELSEWHERE}"),
    ];
    assert_eq!(said(Language::Rapid, text), expected);
}

#[test]
fn urscript() {
    let text = r#"def program():
  global Waypoint_1_p=p[.4,-.5,.3,1.2,.1,.2]
  global Waypoint_1_q=[1.1,-1.5,1.2,-0.3,1.3,0.1]
  global Waypoint_2_q=[1.2,-1.5,1.2,-0.3,1.3,0.1]
  gains_q = [1,2,3,4,5,6]
  home = [0.1,-1.5,1.2,-0.3,1.3,0.1]
  row = [[0.2,-1.5,1.2,-0.3,1.3,0.1],
[0.3,-1.5,1.2,-0.3,1.3,0.1]]
  def go(q, speed):
movej(q, a=1, v=speed)
  end
  $ 2 "movej(Waypoint_2_q)"
  # movel(Waypoint_1_p)
  movej(get_inverse_kin(Waypoint_1_p, qnear=Waypoint_1_q), a=1.4, v=1.05)
  movej(Waypoint_2_q, a=1.4,
    v=1.05) # movej(Waypoint_1_p)
  if (x == home):
movel(pose_trans(Waypoint_1_p, p[0,0,0.1,0,0,0]))
  end
  movej(row[i])
  movej(q=home)
  movec(home, Waypoint_2_q, a=1, v=0.1)
  movec(home, Waypoint_1_p, a=1, v=0.1)
  turned = home
  turned[5] = turned[5] + 0.1
  movej(turned)
  movej(home + [0.1,0,0,0,0,0])
  movej([0.4,-1.5,1.2,-0.3,1.3,0.1])
  servoj([0.5,-1.5,1.2,-0.3,1.3,0.1], t=0.1)
  movep(Waypoint_1_p)
  speedl([0,0,-0.01,0,0,0], 0.5)
  movej([d2r(90),0,0,0,0,0])
  my_movej(home)
end
"#;
    let expected = [
        format!("line 10: movej q {ELSEWHERE}"),
        "line 14: movej get_inverse_kin(Waypoint_1_p, qnear=Waypoint_1_q) is Cartesian".to_owned(),
        "15 movej: Waypoint_2_q".to_owned(),
        "line 18: movel pose_trans(Waypoint_1_p, p[0,0,0.1,0,0,0]) is Cartesian".to_owned(),
        "20 movej: line 7 line 8".to_owned(),
        "21 movej: home".to_owned(),
        "22 movec: home Waypoint_2_q".to_owned(),
        "line 23: movec home, Waypoint_1_p is Cartesian".to_owned(),
        format!("line 26: movej turned {ELSEWHERE}"),
        "line 27: movej home + [0.1,0,0,0,0,0] adds an offset to its target".to_owned(),
        "28 movej: line 28".to_owned(),
        "29 servoj: line 29".to_owned(),
        "line 30: movep Waypoint_1_p is Cartesian".to_owned(),
        "line 31: speedl follows a speed, a force or a sensor".to_owned(),
        "32 movej: line 32".to_owned(),
    ];
    assert_eq!(said(Language::UrScript, text), expected);
    let program = read(Language::UrScript, text);
    let moved: Vec<&str> =
        program.moved_by(Language::UrScript).iter().map(|k| program.targets[*k].name.as_str()).collect();
    assert_eq!(moved, ["Waypoint_2_q", "home", "line 7", "line 8", "line 28", "line 29", "line 32"]);
}

#[test]
fn rapid_routines_with_names_of_motions() {
    let text = "CONST jointtarget j := [[0,-20,20,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
                MoveAbsJSync j, v100, fine, tool0, \"stop\";\nMoveAbsJ_mine j, v100;\n";
    let expected = ["2 MoveAbsJSync: j", "line 3: MoveAbsJ_mine j is an instruction that is not known here"];
    assert_eq!(said(Language::Rapid, text), expected);
}

#[test]
fn urscript_without_joint_targets() {
    let text = "track_conveyor_circular(p[0,0,0,0,0,0], 500.0, False)\n\
                direct_torque([0,0,0,0,0,0])\n\
                mc_add_linear(p[0.1,0.2,0.3,0,0,0], 1.2, 0.25, 0)\n\
                mc_run_motion()\n\
                movej([-90*3.14/180,0,0,0,0,0])\n\
                movej([0,0,0])\n";
    let expected = [
        "line 1: track_conveyor_circular follows a speed, a force or a sensor".to_owned(),
        "line 2: direct_torque follows a speed, a force or a sensor".to_owned(),
        "line 3: mc_add_linear is Cartesian".to_owned(),
        format!("line 4: mc_run_motion {ELSEWHERE}"),
        format!("line 5: movej [-90*3.14/180,0,0,0,0,0] {ELSEWHERE}"),
        "line 6: movej [0,0,0] does not give the robot's joints, all of them and no others".to_owned(),
    ];
    assert_eq!(said(Language::UrScript, text), expected);
}

#[test]
fn krl() {
    let text = "&ACCESS RVP\nDEF work( )\n  DECL AXIS HOME\n  DECL E6POS XP2\n  HOME = {A1 0, A2 -90, A3 90, A4 0, A5 0, A6 0}\n  \
                XP2 = {X 600, Y 0, Z 400, A 0, B 90, C 0}\n  P[1]={E6AXIS: A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0}\n  \
                BAS(#PTP_DAT)\n  ;FOLD PTP P1 Vel=100 % PDAT1;%{PE}\n  PTP $AXIS_ACT\n  PTP HOME C_PTP\n  \
                IF X == 1 THEN\n    LIN XP2 C_DIS\n  ENDIF\n  PTP P[1]\n  PTP XP2\n  PTP XP1\n  \
                PTP {A1 30, A2 -60, A3 75, A4 0, A5 15, A6 0} ; here\n  PTP {A1 30}\n  PTP_REL {A1 10}\n  \
                CIRC {X 1,Y 2,Z 3,A 4,B 5,C 6}, XP2, CA 90\n  SPTP HOME WITH $VEL_AXIS[1]=50\n  PTP HOME:SHIFT\n  LIN_REL {Z 10}\n  \
                PTP {A6 0, A1 10, A2 -80, A3 80, A4 5, A5 30}\n  PTP {A1 10, A2 -80, A3 80, A4 5, A5 TILT, A6 3}\n  \
                ERR = ST_AXISCORR(HAXIS, ID)\n  ERR = ST_ON()\n  ST_SKIPSENS()\n  RSI_MOVECORR()\n  MOVE_EMI E1\nEND\n";
    let expected = [
        "11 PTP: HOME".to_owned(),
        "line 13: LIN XP2 is Cartesian".to_owned(),
        "15 PTP: P[1]".to_owned(),
        "line 16: PTP XP2 is Cartesian".to_owned(),
        "line 17: PTP XP1 goes to a point that is declared in none of the files read".to_owned(),
        "18 PTP: line 18".to_owned(),
        "line 19: PTP {A1 30} does not give the robot's joints, all of them and no others".to_owned(),
        "line 20: PTP_REL {A1 10} adds an offset to its target".to_owned(),
        "line 21: CIRC {X 1,Y 2,Z 3,A 4,B 5,C 6} is Cartesian".to_owned(),
        "22 SPTP: HOME".to_owned(),
        "line 23: PTP HOME:SHIFT adds an offset to its target".to_owned(),
        "line 24: LIN_REL {Z 10} adds an offset to its target".to_owned(),
        "25 PTP: line 25".to_owned(),
        format!("line 26: PTP {{A1 10, A2 -80, A3 80, A4 5, A5 TILT, A6 3}} {ELSEWHERE}"),
        "line 27: ST_AXISCORR follows a speed, a force or a sensor".to_owned(),
        "line 28: ST_ON follows a speed, a force or a sensor".to_owned(),
        "line 29: ST_SKIPSENS follows a speed, a force or a sensor".to_owned(),
        "line 30: RSI_MOVECORR follows a speed, a force or a sensor".to_owned(),
        format!("line 31: MOVE_EMI E1 {ELSEWHERE}"),
    ];
    assert_eq!(said(Language::Krl, text), expected);
    let turned = &read(Language::Krl, text).targets[3];
    assert_eq!(turned.readings, [10.0, -80.0, 80.0, 5.0, 30.0, 0.0]);
}

#[test]
fn fanuc() {
    let joint = |n: u32, v: u32| {
        format!(
            "P[{n}]{{\n   GP1:\n  UF : 0, UT : 1,\n  J1= {v} deg, J2= 2 deg, J3= 3 deg,\n  J4= 4 deg, J5= 5 deg, J6= 6 deg\n}};\n"
        )
    };
    let pose = "P[3:\"J1= 4\"]{\n   GP1:\n  UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n  X = 1.0 mm, Y = 2 mm, Z = 3 mm,\n  W = 0 deg, P = 0 deg, R = 0 deg\n};\n";
    let text = format!(
        "/PROG  WORK\n/ATTR\nDEFAULT_GROUP = 1,*,*,*,*;\n/MN\n   1:  !J P[3] 100% FINE ;\n   2:  //L P[3] 100mm/sec FINE ;\n   \
         3:J P[1] 100% FINE    ;\n   4:L P[2:above] 100mm/sec CNT50 ACC80 ;\n   5:  IF R[1]=1,JMP LBL[3] ;\n   \
         6:L P[3:place] R[7]mm/sec FINE ;\n   7:J P[1] 50% FINE Offset,PR[4] ;\n   8:J PR[2:home] 50% FINE ;\n   \
         9:J P[R[3]] 50% FINE ;\n  10:C P[1]    \n    :  P[3] 100mm/sec FINE    ;\n  11:  CALL GRIP ;\n  12:J P[1] 50% FINE INC ;\n  \
         13:  LBL[3] ;\n  14:C P[1] P[2] 100mm/sec FINE ;\n   :J P[2] 5% CNT R[12:CNTSPD] ;\n/POS\n{}{}{pose}/END\n",
        joint(1, 1),
        joint(2, 2)
    );
    let expected = [
        "7 J: P[1]".to_owned(),
        "8 L: P[2]".to_owned(),
        "line 10: L P[3:place] is Cartesian".to_owned(),
        "line 11: J P[1] adds an offset to its target".to_owned(),
        format!("line 12: J PR[2:home] {ELSEWHERE}"),
        format!("line 13: J P[R[3]] {ELSEWHERE}"),
        "line 14: C P[1] : P[3] is Cartesian".to_owned(),
        "line 17: J P[1] adds an offset to its target".to_owned(),
        "19 C: P[1] P[2]".to_owned(),
        "20 J: P[2]".to_owned(),
    ];
    assert_eq!(said(Language::FanucLs, &text), expected);
    // Groups that move independently, options in German, sensors, pallets, and a tool that stands still.
    let still = "P[4]{\n   GP1:\n  UF : 0, UT : 1,\n  RX = 1.0 mm, RY = 2 mm, RZ = 3 mm\n};\n";
    let text = format!(
        "/PROG  MORE\n/MN\n   1:  Independent GP    ;\n    :  GP1,JP P[1] 100% FINE    ;\n    :  GP2,JP P[2] 100% FINE    ;\n   \
         2:  IF (DI[1]),J P[2] 100% FINE    ;\n   3:J P[1] 100% FINE WKZ_Offset ,PR[1]    ;\n   4:L P[1] 10mm/sec FINE Track TAST[1]    ;\n   \
         5:J PAL_1[BTM] 30% FINE    ;\n   6:L P[4] 10mm/sec FINE    ;\n   7:L P[2:5\" pipe] 10mm/sec CNT R[3:OFFSET]    ;\n   \
         8:J P[1] 10% FINE Skip,LBL[1],PR[5]=LPOS    ;\n/POS\n{}{}{still}/END\n",
        joint(1, 1),
        joint(2, 2)
    );
    let expected = [
        "4 JP: P[1]".to_owned(),
        "line 5: JP P[2] moves another group of axes than the robot's".to_owned(),
        "6 J: P[2]".to_owned(),
        "line 7: J P[1] adds an offset to its target".to_owned(),
        "line 8: L P[1] follows a speed, a force or a sensor".to_owned(),
        format!("line 9: J PAL_1[BTM] {ELSEWHERE}"),
        "line 10: L P[4] is Cartesian".to_owned(),
        "11 L: P[2]".to_owned(),
        "12 J: P[1]".to_owned(),
    ];
    assert_eq!(said(Language::FanucLs, &text), expected);
}

#[test]
fn fanuc_groups() {
    let joint = |groups: &str| format!("/MN\n   1:J P[1] 100% FINE    ;\n/POS\nP[1]{{\n{groups}}};\n/END\n");
    let arm = |n: u32| {
        format!("   GP{n}:\n  UF : 0, UT : 1,\n  J1= 1 deg, J2= 2 deg, J3= 3 deg, J4= 4 deg, J5= 5 deg, J6= 6 deg\n")
    };
    assert_eq!(said(Language::FanucLs, &joint(&arm(1))), ["2 J: P[1]"]);
    // A second arm with the same joints is not this robot.
    let two = joint(&(arm(1) + &arm(2)));
    assert_eq!(said(Language::FanucLs, &two)[0], "line 2: J P[1] moves two groups with as many joints");
}

#[test]
fn yaskawa() {
    let text = "/JOB\n//NAME WORK\n//POS\n///NPOS 3,0,0,1,0,0\n///TOOL 0\n///POSTYPE ANGLE\n///ANGLE\nC00000=1,2,3,4,5,6\nC00001=1,2,3,4,5,7,0\nC00003=1,2,3,4,5,6,7\n\
                ///POSTYPE BASE\n///RECTAN\nC00002=1,2,3,4,5,6\nP0013=0,0,-1,0,0,0\n//INST\n///DATE 2020/10/27 08:23\nNOP\n\
                'MOVL C00002 V=10.0\nMOVJ C00000 VJ=20.00 PL=5\n+MOVJ C00001 VJ=20.00 UNTIL IN#(1)=ON\nMOVL C00002 V=166.6\n\
                MOVJ P[I000] VJ=5.00\nIMOV P013 V=100.0\nSFTON P013\nMOVJ C00000 VJ=20.00\nSFTOF\nMOVJ P020 VJ=5.00\n\
                IFTHENEXP I080<>1\n\tMOVC C00002 V=10.0\nENDIF\n\
                SVSPOTMOV C00001 V=1000.0 GUN#(1)\nSYMOVL C00001 V=100.0 CV#(1)\nMOVJ EC00000 VJ=100.00\n\
                SMOVL C00001 BC00001 V=10.0  +MOVJ EC00001\nMOVJ C00000 VJ=20.00  +MOVJ C00001 VJ=20.00\nMOVJ C00003 VJ=1.00\nEND\n";
    let expected = [
        "19 MOVJ: C00000".to_owned(),
        "line 20: +MOVJ C00001 moves another group of axes than the robot's".to_owned(),
        "line 21: MOVL C00002 is Cartesian".to_owned(),
        format!("line 22: MOVJ P[I000] {ELSEWHERE}"),
        "line 23: IMOV P013 adds an offset to its target".to_owned(),
        "line 25: MOVJ C00000 adds an offset to its target".to_owned(),
        format!("line 27: MOVJ P020 {ELSEWHERE}"),
        "line 29: MOVC C00002 is Cartesian".to_owned(),
        "line 31: SVSPOTMOV C00001 is an instruction that is not known here".to_owned(),
        "line 32: SYMOVL C00001 follows a speed, a force or a sensor".to_owned(),
        "line 33: MOVJ EC00000 moves external axes".to_owned(),
        "34 SMOVL: C00001".to_owned(),
        "35 MOVJ: C00000".to_owned(),
        "line 35: +MOVJ C00001 moves another group of axes than the robot's".to_owned(),
        "line 36: MOVJ C00003 does not give the robot's joints, all of them and no others".to_owned(),
    ];
    assert_eq!(said(Language::Jbi, text), expected);
}

/// What `plan` writes is corrected wholly.
#[test]
fn programs_of_our_own_move_by_joint_targets_alone() {
    let stop = |k: f64| Stop { name: format!("p{k}"), readings: vec![k; 6], approach: vec![k - 1.0; 6] };
    let motion = Motion { speed_percent: 20.0, dwell_s: 1.0 };
    let joints = Joints { slides: &[false; 6], pulses_per_deg: &[] };
    for language in Language::ALL {
        let (_, text) = program(language, "plan", &[stop(1.0), stop(2.0)], &motion, joints).swap_remove(0);
        let program = read(language, &text);
        assert_eq!(program.motions.len(), 4, "{language:?}: {text}");
        assert_eq!(program.moved_by(language), [0, 1, 2, 3], "{language:?}: {text}");
    }
}
