"""Keys through the new nodes: what is read must have been written on some way, and better on every way."""

import pytest

LOOK = "{look_for_user: , out: {user: u}}"
USE = "{navigate_to: {goal: $u}}"
NEVER = "is read before any node has written it"
MAYBE = "may have no value here"


@pytest.mark.parametrize(
    ("tree", "expected"),
    [
        # branches
        ("{sequence: [{if: $b, then: LOOK}, USE]}", MAYBE),
        ("{sequence: [{if: $b, then: LOOK, else: LOOK}, USE]}", None),
        ("{sequence: [{if: $b, then: LOOK, else: {fail: x}}, USE]}", None),
        ("{sequence: [{if: LOOK, then: USE}]}", None),
        ("{if: LOOK, then: {wait: 1 s}, else: USE}", NEVER),
        ("{if: {invert: LOOK}, then: {wait: 1 s}, else: USE}", None),
        ("{if: $b, then: LOOK, else: USE}", NEVER),
        ("{if: $b, then: LOOK, else: USE, memory: false}", MAYBE),
        ("{sequence: [{switch: $b, cases: {true: LOOK}}, USE]}", None),  # fails when no case fits
        ("{sequence: [{switch: $b, cases: {true: LOOK}, default: {wait: 1 s}}, USE]}", MAYBE),
        ("{sequence: [{switch: $b, cases: {true: LOOK, false: LOOK}}, USE]}", None),
        # guards
        ("{sequence: [{look_for_user: , out: {user: u}, when: $b}, USE]}", MAYBE),
        (
            "{sequence: [{selector: [{look_for_user: , out: {user: u}, when: $b}]}, USE]}",
            None,
        ),
        ("{sequence: [{look_for_user: , out: {user: u}, while: $b}, USE]}", None),
        ("{sequence: [{wait: 1 s, when: $u.x > 1 m}, LOOK]}", NEVER),
        ("{sequence: [LOOK, {wait: 1 s, when: $u.x > 1 m}]}", None),
        ("{parallel: [{repeat: 3, do: LOOK}, {wait: 1 s, while: $u.x > 1 m}]}", MAYBE),
        # decorators
        ("{sequence: [{succeed: LOOK}, USE]}", MAYBE),
        ("{sequence: [{once: LOOK}, USE]}", None),
        ("{sequence: [{sequence: [{wait: 1 s}, LOOK]}, USE]}", None),
        ("{selector: [{timeout: 5 s, do: {sequence: [LOOK, {wait: 9 s}]}}, USE]}", MAYBE),
        ("{selector: [{invert: LOOK}, USE]}", None),  # it fails only after the look has succeeded
        # loops: what a later round finds, the first one may lack
        ("{repeat: 3, do: {sequence: [{succeed: USE}, LOOK]}}", MAYBE),
        ("{repeat: 3, do: {selector: [USE, LOOK]}}", MAYBE),
        ("{repeat: 3, do: {sequence: [USE, LOOK]}}", NEVER),
        ("{retry: 3, do: {sequence: [USE, LOOK]}}", NEVER),
        ("{retry: 3, do: {sequence: [{succeed: USE}, LOOK, {turn: {angle: 5 deg}}]}}", MAYBE),
        ("{retry: 3, attempt: n, do: {condition: $n > 1}}", None),
        # without memory earlier nodes see what later ones wrote
        ("{sequence: [{succeed: USE}, LOOK, {wait: 1 s}]}", NEVER),
        ("{sequence: [{succeed: USE}, LOOK, {wait: 1 s}], memory: false}", MAYBE),
        # parallels
        ("{sequence: [{parallel: [LOOK, {wait: 1 s}], policy: {succeed: 1}}, USE]}", MAYBE),
        ("{sequence: [{parallel: [LOOK, {wait: 1 s}], policy: {succeed: 2}}, USE]}", None),
        (
            "{sequence: [{parallel: [{name: a, once: LOOK}, {wait: 1 s}], policy: [a]}, USE]}",
            None,
        ),
        ("{sequence: [{parallel: [LOOK, {wait: 1 s, name: a}], policy: [a]}, USE]}", MAYBE),
        ("{parallel: [LOOK, USE]}", MAYBE),
        # clean-ups
        ("{sequence: [LOOK, {wait: 1 s}], finally: USE}", MAYBE),
        ("{sequence: [LOOK, {wait: 1 s, finally: USE}]}", None),
        ("{wait: 1 s, finally: USE}", "no node writes a key 'u'"),
    ],
)
def test_reads(workshop, tree, expected):
    text = tree.replace("LOOK", LOOK).replace("USE", USE)
    found = workshop.lines(f"tree: {text}\ninputs: {{b: {{type: boolean, default: true}}}}\n")
    told = [line for line in found if any(word in line for word in (NEVER, MAYBE, "no node writes"))]
    assert [expected in line for line in told] == ([True] if expected else []), found


def test_declared_keys(workshop):
    keys = "keys: {n: {type: integer, default: 0}, far: {type: length}, idle: {type: text}}\n"
    lines = workshop.lines(
        "tree:\n  sequence:\n"
        '    - set: {n: "${$n + 1}"}\n'
        "    - set: {n: 2 m}\n"
        '    - set: {n: "${$n / 2}"}\n'
        "    - wait: 1 s\n      when: $far > 1 m\n"
        "    - look_for_user:\n      out: {distance: far, user: n}\n" + keys
    )
    assert lines == [
        "5:16 error n: a whole number is needed, not '2 m' | 3",
        "6:19 error n: '$n / 2' is a number; an integer is needed | ",
        "8:13 error the key 'far' is read before any node has written it | "
        "the node of line 10 before this one, a default of 'far' under keys:",
        "10:34 error the key 'n' is declared as an integer, but a pose is written here | ",
        "11:61 warning nothing reads or writes the key 'idle' | ",
    ]


def test_what_nobody_reads(workshop):
    lines = workshop.lines(
        "inputs: {a: {type: integer}, b: {type: integer}}\n"
        "outputs: {far: {type: length}}\n"
        "tree:\n  sequence:\n"
        "    - look_for_user:\n      out: {user: person, distance: far}\n"
        "    - set: {room: hall, seen: true}\n"
        "    - retry: $a\n      attempt: trial\n      do: {turn: {angle: 5 deg}}\n"
        '    - wait: 1 s\n      because: "$seen"\n'
    )
    assert [line.split(" |")[0] for line in lines] == [
        "2:30 warning nothing reads the input 'b'",
        "7:19 warning nothing reads the output that goes to the key 'person'",
        "8:13 warning nothing reads the key 'room'",
        "10:16 warning nothing reads the key 'trial'",
    ]


@pytest.mark.parametrize(
    ("tree", "at", "problem"),
    [
        ("{condition: $l < 3 s}", "<", "'$l' is a length and '3 s' is a duration"),
        ("{condition: $l}", "$l", "'$l' is a length; true or false is needed | $l > 0 m"),
        ("{if: $l + 1 m, then: {wait: 1 s}}", "$l", "if: '$l + 1 m' is a length; true or false is needed"),
        ("{wait: 1 s, while: $p > 1 m}", "$p", "while: '>' needs numbers or quantities, but '$p' is a pose"),
        ('{wait: "${$l}"}', None, "duration is needed"),
        ('{wait: "${$l / $v}"}', None, None),
        ('{turn: {angle: "${$l / 2}"}}', "$l", "angle: '$l / 2' is a length; an angle is needed"),
        (
            "{switch: $l, cases: {1 m: {wait: 1 s}, 100 cm: {wait: 2 s}}}",
            "100 cm",
            "the case '100 cm' is duplicated",
        ),
        ("{switch: $l, cases: {fast: {wait: 1 s}}}", "fast", "case: a length is needed, not 'fast'"),
        ("{timeout: 3 m, do: {wait: 1 s}}", "3 m", "timeout: 'm' is not a unit of a duration"),
        ("{timeout: $l, do: {wait: 1 s}}", "$l", "timeout: a duration is needed, but $l is a length"),
        (
            "{look_for_user: {window: $long}}",
            "$long",
            "window: the default of $long does not fit: 1 min is above",
        ),
        (
            "{retry: $zero, do: {turn: {angle: 5 deg}}}",
            "$zero",
            "the default of $zero does not fit: 0 is below",
        ),
        ("{navigate_to: {goal: {x: $v, y: 1 m, yaw: 0}}}", "$v", "a length is needed, but $v is a speed"),
    ],
)
def test_kinds(workshop, tree, at, problem):
    inputs = (
        "inputs: {l: {type: length}, v: {type: speed, min: 0.1 m/s}, p: {type: pose},"
        " long: {type: duration, default: 1 min}, zero: {type: integer, default: 0}}\n"
    )
    found = workshop.lines(f"tree: {tree}\n{inputs}")
    lines = [line for line in found if "nothing reads" not in line and "meanwhile" not in line]
    if problem is None:
        assert lines == []
        return
    (line,) = lines
    assert problem in line and " error " in line
    assert at is None or line.startswith(f"2:{f'tree: {tree}'.rindex(at) + 1} "), line
