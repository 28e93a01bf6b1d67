//! What leads the arm or shifts its motions, and instructions that are not known: none of them is passed over.

use super::said;
use crate::programs::*;

const LED: &str = "follows a speed, a force or a sensor";
const SHIFTED: &str = "adds an offset to its target";
const UNKNOWN: &str = "is an instruction that is not known here";
const ELSEWHERE: &str = "moves by values that are not numbers in this file";

#[test]
fn yaskawa() {
    let job = |lines: &str| {
        format!(
            "/JOB\n//NAME SEAM\n//POS\n///NPOS 2,0,0,0,0,0\n///TOOL 0\n///POSTYPE ANGLE\n///ANGLE\nC00000=5,-10,20,0,40,7\n\
             C00001=6,-12,24,1,42,8\n//INST\n///DATE 2024/02/01 10:00\n///ATTR SC,RW\n///GROUP1 RB1\nNOP\n{lines}END\n"
        )
    };
    // What is known to move nothing, with conditions, labels, remarks and blanks.
    let clean = job(
        "*START\n'FORMCUT FCF#(1)\n\tMOVJ C00000 VJ=10.00 UNTIL IN#(1)=ON\nDOUT OT#(4) ON IF B001=2\nJUMP *START IF IN#(2)=OFF\n\
                     MEMON REC MPF#(2)\nMOVL C00001 V=20.0\nMEMOF\nWVON WEV#(1)\nMOVL C00000 V=10.0\nWVOF\nMACRO7 MJ#(7) ARGF1\nREFP 1 C00000\n\x1a\n",
    );
    assert_eq!(said(Language::Jbi, &clean), ["17 MOVJ: C00000", "21 MOVL: C00001", "24 MOVL: C00000"]);
    for (begin, end, cause) in [
        ("COMARCON AMP=2.0", "COMARCOF", LED),
        ("FLOATON FL#(3)", "FLOATOF", LED),
        ("IMPON RB1 X=1", "IMPOF", LED),
        ("MEMON PLY MPF#(2)", "MEMOF", LED),
    ] {
        let (word, target) = begin.split_once(' ').unwrap();
        let text = job(&format!("{begin}\nMOVL C00000 V=9.0\n{end}\nMOVJ C00001 VJ=3.00\n"));
        let target = target.split(' ').next().unwrap();
        let expected = [
            format!("line 15: {word} {target} {cause}"),
            format!("line 16: MOVL C00000 {cause}"),
            "18 MOVJ: C00001".to_owned(),
        ];
        assert_eq!(said(Language::Jbi, &text), expected);
    }
    let text = job(
        "SFTON P003 UF#(1)\nMOVL C00000 V=9.0\nSFTOF\nFORMCUT FCF#(4)\nGLIDETO C00001 SLOW\nMOVJ C00001 VJ=3.00\nMOVJ\n",
    );
    let expected = [
        format!("line 16: MOVL C00000 {SHIFTED}"),
        format!("line 18: FORMCUT FCF#(4) {ELSEWHERE}"),
        format!("line 19: GLIDETO C00001 {UNKNOWN}"),
        "20 MOVJ: C00001".to_owned(),
        format!("line 21: MOVJ {ELSEWHERE}"),
    ];
    assert_eq!(said(Language::Jbi, &text), expected);
}

/// Jobs of a few lines have no `///POSTYPE`.
#[test]
fn yaskawa_without_types() {
    let joints = Joints { slides: &[false; 6], pulses_per_deg: &[1000.0; 6] };
    let job = |heading: &str, place: &str| {
        format!("/JOB\n//POS\n///NPOS 1,0,0,0,0,0\n{heading}C00000={place}\n//INST\nNOP\nMOVJ C00000 VJ=1.0\nEND\n")
    };
    for heading in ["///PULSE\n", ""] {
        let program = Program::read(Language::Jbi, &job(heading, "4000,-5000,6000,0,7000,-8000"), joints).unwrap();
        assert_eq!(program.targets[0].readings, [4.0, -5.0, 6.0, 0.0, 7.0, -8.0]);
        assert_eq!(program.motions[0].moves_by, Ok(vec![0]));
    }
    for (heading, cause) in [("///RECTAN\n", Cause::Cartesian), ("", Cause::Untyped)] {
        let program = Program::read(Language::Jbi, &job(heading, "400.0,-50.0,60.0,0.0,70.0,-80.0"), joints).unwrap();
        assert!(program.targets.is_empty() && program.motions[0].moves_by == Err(cause), "{heading}");
    }
}

#[test]
fn fanuc() {
    let position = |n: u32| {
        format!(
            "P[{n}]{{\n   GP1:\n  UF : 0, UT : 1,\n  J1= {n} deg, J2= 2 deg, J3= 3 deg,\n  J4= 4 deg, J5= 5 deg, J6= 6 deg\n}};\n"
        )
    };
    let listing = |lines: &str| format!("/PROG  SEAM\n/MN\n{lines}/POS\n{}{}/END\n", position(1), position(2));
    for (begin, end, cause) in [
        ("Touch Offset PR[3]", "Touch Offset End", SHIFTED),
        ("MP Offset PR[3] RPM[1]", "MP Offset End", SHIFTED),
        ("Track TAST[2]", "Track End", LED),
        ("SOFTFLOAT[4]", "SOFTFLOAT END", LED),
        ("SOFTFLOAT ON", "SOFTFLOAT OFF", LED),
    ] {
        let text = listing(&format!(
            "   1:J P[1] 100% FINE    ;\n   2:  {begin} ;\n   3:L P[2:\"seam\"] 9mm/sec FINE    ;\n   4:  {end} ;\n   5:J P[1] 50% FINE    ;\n"
        ));
        let said = said(Language::FanucLs, &text);
        let (motions, led): (Vec<_>, Vec<_>) = said
            .iter()
            .cloned()
            .partition(|line| ["3 J", "line 5: L", "7 J"].iter().any(|head| line.starts_with(head)));
        let of_position = |cause: &str| format!("line 5: L P[2:\"seam\"] {cause}");
        assert_eq!(motions, ["3 J: P[1]".to_owned(), of_position(cause), "7 J: P[1]".to_owned()]);
        let word = begin.split(['[', ' ']).next().unwrap();
        let expected: Vec<String> = (cause == LED).then(|| format!("line 4: {word} {cause}")).into_iter().collect();
        assert_eq!(led, expected);
    }
    let text = listing("   1:  OFFSET CONDITION PR[3]    ;\n   2:J P[1] 100% FINE    ;\n   3:  FORCE CTRL[2] ;\n");
    assert_eq!(said(Language::FanucLs, &text), ["4 J: P[1]".to_owned(), format!("line 5: FORCE CTRL {LED}")]);
    let text = listing("   1:J P[1] 100% FINE    ;\n   2:J P[2] 100% FINE    \n");
    assert_eq!(
        said(Language::FanucLs, &text),
        ["3 J: P[1]", "line 4: J P[2] has no `;` at its end: is the file cut off?"]
    );
}

#[test]
fn rapid() {
    let module = |lines: &str| {
        format!(
            "MODULE cell\nCONST jointtarget jDock:=[[5,-10,20,0,40,7],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
             CONST jointtarget jRack:=[[6,-12,24,1,42,8],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
             CONST robtarget pPart:=[[500,0,400],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\n\
             MoveAbsJ jDock,vSlow,fine,tGrip;\n{lines}ENDPROC\nPROC Visit(jointtarget jTo)\nENDPROC\nENDMODULE\n"
        )
    };
    let clean = "Visit jRack;\nDockIt jDock;\nVisit Offs(pPart,0,0,9);\nTPWrite \"at\" + ValToStr(jRack);\nWaitTime 1;\nReset doLamp;\n\
                 jLast:=jRack;\nRETURN jRack;\nBlink 5, \\Fast;\nBlink;\nMoveLamp 3;\nIF jDock=jRack Blink;\nVAR robtarget pNow;\n\
                 UseNumber pPart.trans.x;\nPDispOn pPart, tGrip;\nWZHomeJointDef \\Inside, wz, jRack, jSpan;\nx:=known(jRack);\n\
                 ! BEUpdateTcp tGrip;\n";
    assert_eq!(said(Language::Rapid, &module(clean)), ["6 MoveAbsJ: jDock"]);
    for (statement, expected) in [
        ("BEUpdateTcp tGrip\\XYZOnly;", format!("BEUpdateTcp tGrip {ELSEWHERE}")),
        ("PathRecMoveBwd;", format!("PathRecMoveBwd {ELSEWHERE}")),
        ("LoadId TOOL_LOAD_ID, WRIST, tGrip;", format!("LoadId TOOL_LOAD_ID {ELSEWHERE}")),
        ("MovePose pPark;", format!("MovePose pPark {UNKNOWN}")),
        ("DockIt jRack;", format!("DockIt jRack {UNKNOWN}")),
        (
            "DockIt [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];",
            format!("DockIt [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]] {UNKNOWN}"),
        ),
        ("IF bOk THEN DockIt \\Fast, jRack; ENDIF", format!("DockIt jRack {UNKNOWN}")),
        ("TEST n CASE 1,2: DockIt 4, pPart;", format!("DockIt 4 {UNKNOWN}")),
        ("DockIt 4 \\To:=jRack, vSlow;", format!("DockIt 4 {UNKNOWN}")),
        ("DockIt Offs(pPart,0,0,9);", format!("DockIt Offs(pPart,0,0,9) {UNKNOWN}")),
        ("MyMoveJ jRack,vSlow,zNear,tGrip;", format!("MyMoveJ jRack {UNKNOWN}")),
        ("Visit jDock, v100;", format!("Visit jDock {ELSEWHERE}")),
        ("SoftAct 3, 20;", format!("SoftAct 3 {LED}")),
        ("ArcMoveL pPart,vSlow,zNear,tGrip;", "ArcMoveL pPart is Cartesian".to_owned()),
    ] {
        let expected = format!("line 7: {expected}");
        assert_eq!(
            said(Language::Rapid, &module(&format!("{statement}\n"))),
            ["6 MoveAbsJ: jDock".to_owned(), expected]
        );
    }
    let arc = module("ArcMoveAbsJ [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]], vSlow, zNear, tGrip;\n");
    assert_eq!(said(Language::Rapid, &arc), ["6 MoveAbsJ: jDock", "7 ArcMoveAbsJ: line 7"]);
    // Without its end, at the end and before another one.
    let unended = "has no `;` at its end: is the file cut off?";
    let text =
        module("MoveAbsJ jRack,vSlow,fine,tGrip\nMoveAbsJ jDock,vSlow,fine,tGrip;\nMoveAbsJ jRack,vSlow,fine,tGrip\n");
    let expected = [
        "6 MoveAbsJ: jDock".to_owned(),
        format!("line 7: MoveAbsJ jRack {unended}"),
        "8 MoveAbsJ: jDock".to_owned(),
        format!("line 9: MoveAbsJ jRack {unended}"),
    ];
    assert_eq!(said(Language::Rapid, &text), expected);
}

#[test]
fn urscript() {
    let script = |lines: &str| {
        format!(
            "def cell():\n  dock=[0.1,-1.2,0.9,-0.4,1.5,0.2]\n  rack=[0.2,-1.2,0.9,-0.4,1.5,0.2]\n  part=p[0.4,-0.2,0.3,0,3.1,0]\n  def visit(q):\n    \
             movej(dock)\n  end\n{lines}end\n"
        )
    };
    let clean = "  visit(rack)\n  fetch(dock)\n  if (dock == rack):\n    n=norm(rack)\n  end\n  pose=get_forward_kin(rack)\n  cam.send(rack)\n  grip_move(200)\n  \
                 place(part)\n";
    assert_eq!(said(Language::UrScript, &script(clean)), ["6 movej: dock"]);
    for (call, target) in [
        ("fetch(rack)", "rack"),
        ("fetch(1, to=rack)", "1"),
        ("fetch([0,-1,1,0,1,0])", "[0,-1,1,0,1,0]"),
        ("lift_move(part)", "part"),
    ] {
        let expected = format!("line 8: {} {target} {UNKNOWN}", call.split('(').next().unwrap());
        assert_eq!(said(Language::UrScript, &script(&format!("  {call}\n"))), ["6 movej: dock".to_owned(), expected]);
    }
}

/// Points by what declares them, where no numbers are.
#[test]
fn krl() {
    let text = "DEF a( )\nDECL E6POS VIA[2], LAST\nDECL E6AXIS REST\nPTP VIA[1]\nVIA[1].Z = H + 20\nPTP LAST\nPTP REST\nPTP XDOCK\nPTP NEAR\n\
                PTP $POS_RET\nNEAR = LAST\nEND\nDEFDAT a\nVIA[1]={X 1,Y 2,Z 3,A 4,B 5,C 6}\nENDDAT\n";
    let expected = [
        "line 4: PTP VIA[1] is Cartesian".to_owned(),
        "line 6: PTP LAST is Cartesian".to_owned(),
        format!("line 7: PTP REST {ELSEWHERE}"),
        "line 8: PTP XDOCK goes to a point that is declared in none of the files read".to_owned(),
        format!("line 9: PTP NEAR {ELSEWHERE}"),
        format!("line 10: PTP $POS_RET {ELSEWHERE}"),
    ];
    assert_eq!(said(Language::Krl, text), expected);
    // Routines of other files.
    let text = |call: &str| {
        format!(
            "DEF a( )\nDECL E6AXIS DOCK, RACK\nDECL E6POS PART\nDOCK={{A1 5,A2 -90,A3 90,A4 0,A5 40,A6 7}}\nRACK={{A1 6,A2 -90,A3 90,A4 0,A5 40,A6 7}}\n\
             PTP DOCK\n{call}\nEND\nDEF own(P :IN)\nEND\n"
        )
    };
    for clean in
        ["own(RACK)", "P = FORWARD(RACK, ERR)", "lamp(3)", "place(PART)", "IF (RACK.A1 > 0) THEN", "show(RACK.A1)"]
    {
        assert_eq!(said(Language::Krl, &text(clean)), ["6 PTP: DOCK"], "{clean}");
    }
    for (call, target) in
        [("fetch(3, RACK)", "RACK"), ("fetch({A1 1,A2 2,A3 3,A4 4,A5 5,A6 6})", "{A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}")]
    {
        assert_eq!(
            said(Language::Krl, &text(call)),
            ["6 PTP: DOCK".to_owned(), format!("line 7: fetch {target} {UNKNOWN}")]
        );
    }
}
