//! Targets that something writes into at run time: the numbers in the file say nothing of the motion then.

use super::said;
use crate::programs::Language;

/// Whether the program's motion still moves by its target with this statement in it, which may itself be doubted.
fn kept(language: Language, program: &str, statement: &str) -> bool {
    let said = said(language, &program.replace("HERE", statement));
    let (motion, others) = said.split_last().unwrap();
    assert!(others.iter().all(|other| other.ends_with("is an instruction that is not known here")), "{said:?}");
    let written = motion.ends_with("moves by values that are not numbers in this file");
    assert!(written || !motion.starts_with("line"), "{said:?}");
    !written
}

#[test]
fn rapid() {
    let program = "MODULE m
  VAR jointtarget jt:=[[10,20,30,40,50,60],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jHome:=[[0,-20,20,0,70,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  FUNC bool known(PERS jointtarget j, num n)
    RETURN TRUE;
  ENDFUNC
  PROC main()
    HERE
    MoveAbsJ jt,v100,fine,tool0;
  ENDPROC
  PROC show(jointtarget j)
  ENDPROC
  PROC change(\\switch Fast, INOUT jointtarget j)
  ENDPROC
ENDMODULE
";
    for statement in [
        "ok := StrToVal(sTxt, jt);",
        "GetTarget jt;",
        "change \\Fast, jt;",
        "change jt;",
        "b := known(jt, 1);",
        "GetTarget \"name\", jt;",
        "GetTarget -1, jt;",
        "GetTarget \\Into:=jt;",
        "UnpackRawBytes raw, 1, jt \\Float4;",
        "RMQGetMsgData msg, jt;",
        "IF bOk THEN ReadIt(jt.robax.rax_1); ENDIF",
        "IF di1 = 1 GetTarget jt;",
        "%\"GetTarget\"% jt;",
        "SetDataVal name, value;",
        "Incr jt.robax.rax_1;",
        "jt.robax.rax_1 := 5;",
    ] {
        assert!(!kept(Language::Rapid, program, statement), "{statement}");
    }
    for statement in [
        "",
        "show jt;",
        "GetTarget jHome;",
        "p1 := CalcRobT(jt, tool0);",
        "TPWrite \"at \", \\Num:=jt.robax.rax_1;",
        "IF jt = jHome THEN Stop; ENDIF",
        "jOld := jt;",
        "x := 2 * (jt.robax.rax_1 + 1);",
        "WHILE n < jt.robax.rax_1 DO n := n + 1; ENDWHILE",
        "TPWrite \"GetTarget jt\";",
        "! GetTarget jt;",
    ] {
        assert!(kept(Language::Rapid, program, statement), "{statement}");
    }
    let line = "MoveAbsJ jt,v100,fine,tool0;";
    for line in ["MoveAbsJ \\Conc, jt\\NoEOffs,v100,fine,tool0;", "IF bOk MoveAbsJ jt,v100,fine,tool0;"]
        .map(|other| program.replace(line, other))
    {
        assert!(kept(Language::Rapid, &line, ""), "{line}");
    }
}

#[test]
fn krl() {
    let program = "DEF a( )\nDECL E6AXIS HOME\nHOME = {A1 10, A2 -80, A3 80, A4 5, A5 30, A6 0, E1 0}\nHERE\nPTP HOME\nEND\n\
                   DEF show(P:IN, N :IN)\nEND\nDEF change(P:OUT)\nEND\n";
    for statement in [
        "change(HOME)",
        "other(1, HOME)",
        "RET=EKI_GetReal(\"ch\",\"R/A1\",HOME.A1)",
        "CREAD($CMD,STAT,MODE,OFFSET,\"%r\",HOME.A1)",
        "IF ok(HOME) THEN",
        "HOME.A1 = 5",
    ] {
        assert!(!kept(Language::Krl, program, statement), "{statement}");
    }
    for statement in ["show(HOME, 1)", "IF (HOME.A1 > 0) THEN", "OLD = HOME", ";change(HOME)", "P = FORWARD(HOME, ERR)"]
    {
        assert!(kept(Language::Krl, program, statement), "{statement}");
    }
}

#[test]
fn yaskawa() {
    let program = "/JOB\n//POS\n///NPOS 0,0,0,2,0,0\n///POSTYPE ANGLE\n///ANGLE\nP00127=0,-80,-25,0,-11,0\nP00001=1,2,3,4,5,6\n//INST\nNOP\nHERE\n\
                   MOVJ P127 VJ=5.00\nEND\n";
    for statement in [
        "SETE P127 (1) 0",
        "SET P127 P001",
        "GETS PX127 $PX000",
        "ADD P127 P001",
        "CNVRT PX127 PX001 BF",
        "SET P[I000] P001",
        "VREAD 1 P127",
        "\tLOADV P127",
    ] {
        assert!(!kept(Language::Jbi, program, statement), "{statement}");
    }
    for statement in
        ["SET P001 P127", "GETE D000 P127 (1)", "'SETE P127 (1) 0", "COMM SETE P127 (1) 0", "SETE P001 (1) D127"]
    {
        assert!(kept(Language::Jbi, program, statement), "{statement}");
    }
}

#[test]
fn fanuc() {
    let position =
        "{\n   GP1:\n  UF : 0, UT : 1,\n  J1= 1 deg, J2= 2 deg, J3= 3 deg, J4= 4 deg, J5= 5 deg, J6= 6 deg\n};\n";
    let program = format!(
        "/MN\n   1:  HERE ;\n   2:J P[1:home] 100% FINE    ;\n/POS\nP[1:\"home\"]{position}P[2]{position}/END\n"
    );
    for statement in ["P[1]=PR[2]", "P[1:home]=JPOS", "P[R[3]]=PR[2]"] {
        assert!(!kept(Language::FanucLs, &program, statement), "{statement}");
    }
    for statement in ["PR[1]=P[1]", "P[2]=PR[2]", "!P[1]=PR[2]", "IF R[1]=1,JMP LBL[2]"] {
        assert!(kept(Language::FanucLs, &program, statement), "{statement}");
    }
}

#[test]
fn urscript() {
    let program = "def a():\n  home = [0.1,-1.5,1.2,-0.3,1.3,0.1]\n  HERE\n  movej(home)\nend\n";
    for statement in ["home.append(1)", "home[2] = 1", "home = other()"] {
        assert!(!kept(Language::UrScript, program, statement), "{statement}");
    }
    // Calls get values.
    for statement in ["show(home)", "n = home.length()", "if get_list_length(home) == 6:"] {
        assert!(kept(Language::UrScript, program, statement), "{statement}");
    }
}
