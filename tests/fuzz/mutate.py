"""Inputs for the fuzz test: scenes as YAML, as plain options and as arguments, spheres as CSV, each a small good one with something done to it.

inputs(seed, count, keys) yields Input(files, arguments, expected): files by name as bytes, arguments of dlmfd, and, where one value alone was made bad, the words that
the message must hold. keys: {key: what is allowed}, as docs/options.md has them.
"""
import random
from collections import namedtuple

Input = namedtuple("Input", "kind files arguments expected")

SCENE = {"box_size": "1,1,1", "box_periodic": "1,1,0", "grid_resolution": "8", "wall_velocity_lower": "-1,0,0", "wall_velocity_upper": "1,0,0", "fluid_density": "1",
         "fluid_viscosity": "1", "sphere_radius": "0.2", "sphere_centers": "0.25,0,0,-0.25,0,0", "ts_dt": "0.05", "ts_max_time": "0.1"}
CSV = "# spheres\nx1,x2,x3,radius,density,motion\n0.25,0,0,0.2,1,free\n-0.25,0,0,0.2,1.5,rotate\n"
CSV_SCENE = "-box_size 1,1,1 -grid_resolution 8 -spheres_file s.csv".split()
COLUMNS = "x1 x2 x3 radius density motion V1 V2 V3 omega1 omega2 omega3 F1 F2 F3 T1 T2 T3".split()
NUMBERS = ["nan", "NaN", "-nan", "inf", "-Infinity", "1e999", "-1e999", "1e308", "-1e308", "1e-320", "4.9e-324", "0", "-0", "0x10", "1d3", "1.2.3", "1e", "e1", "+", "-", ".", "1_000", "1,5", "٣",
           "2147483647", "2147483648", "-2147483649", "9223372036854775808", "9" * 400, "0." + "0" * 300 + "1", "1e+0000000000000001", "--1", "1 2", "1;2", "1/2", "½", "1e5000000000"]
WORDS = ["", " ", "true", "false", "yes", "off", "null", "~", "auto", "free", "lie", "newtonian", "oldroyd_b", "both_sides", "ﬂuid", "日本語", "a" * 600, "x" * 5000, "%s%n%d", "${HOME}", "`id`", "\\",
         "'", '"', "[", "{", "]", "}", "&a", "*a", "!!int 3", "|", ">", "?", ":", "-", "---", "...", "#", "@", "%", "\x1b[31m", "\x00", "\x7f", "\ud83d".encode("utf-16", "surrogatepass").decode("latin-1"),
         "-ts_dt", "-help", "1,2,3", "1,2", ",", ",,", "1,,3", "1,2,3,", "/dev/null", "../..", "."]
# an occurrence of one of these in a message means that a hole was left in it
HOLES = ("(null)", "%s", "%d", " nan ")


def value(chance):
    pick = chance.random()
    if pick < 0.4:
        return chance.choice(NUMBERS)
    if pick < 0.7:
        return chance.choice(WORDS)
    if pick < 0.9:
        return ",".join(chance.choice(NUMBERS + ["1", "2", "0.5"]) for _ in range(chance.choice([1, 2, 3, 3, 3, 4, 6, 30])))
    return "".join(chr(chance.choice([chance.randrange(32, 127), chance.randrange(0x80, 0x2fff)])) for _ in range(chance.randrange(1, 40)))


def misspelt(chance, word):
    letters = list(word)
    for _ in range(chance.randrange(1, 4)):
        at = chance.randrange(len(letters)) if letters else 0
        what = chance.randrange(4)
        if what == 0 and letters:
            del letters[at]
        elif what == 1:
            letters.insert(at, chance.choice("abcxyz_0- .:\t#"))
        elif what == 2 and letters:
            letters[at] = letters[at].swapcase()
        elif letters:
            letters[at:at + 2] = letters[at:at + 2][::-1]
    return "".join(letters)


def key(chance, keys):
    pick = chance.random()
    if pick < 0.55:
        return chance.choice(list(keys))
    if pick < 0.75:
        return misspelt(chance, chance.choice(list(keys)))
    if pick < 0.85:
        return chance.choice(["ts_type", "stokes_ksp_type", "stokes_pc_type", "saddle_fieldsplit_bodies_ksp_max_it", "saddle_split", "ts_monitor", "ksp_rtol", "saddle_ksp_type", "stokes_velocity_pc_type", "options_file", "prefix_push", "log_view_", "malloc", "on_error_abort", "mat_type", "info_"])
    return chance.choice(["", "-", "--", "1", "-1", " ", "é", "a" * 300, "a" * 600, "b" * 6000, "a.b", "a:b", "a b", "\t", "?", "*x", "&x", "<<", "\x01", "_", "[1]", "{a}"])


def pairs(chance, keys):
    """A list of keys and values: the good scene with some changed, added, doubled or taken away."""
    scene = list(SCENE.items())
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8, 40])):
        what, at = chance.randrange(5), chance.randrange(len(scene)) if scene else 0
        if what == 0 and scene:
            scene[at] = (scene[at][0], value(chance))
        elif what == 1 and scene:
            scene[at] = (misspelt(chance, scene[at][0]), scene[at][1])
        elif what == 2 and scene:
            del scene[at]
        elif what == 3 and scene:
            scene.append((scene[at][0], value(chance)))
        else:
            scene.insert(at, (key(chance, keys), value(chance)))
    return scene


def yaml(chance, scene):
    lines = []
    for name, text in scene:
        style = chance.randrange(12)
        if style == 0 and "_" in name:
            first, rest = name.split("_", 1)
            lines.append(f"{first}:\n{chance.choice(['  ', '    ', chr(9), ' '])}{rest}: {text}")
        elif style == 1:
            lines.append(f"{name}: [{text}]")
        elif style == 2:
            lines.append(f"{name}: &a{len(lines)} {text}\nother{len(lines)}: *a{chance.randrange(len(lines) + 1)}")
        elif style == 3:
            lines.append(f"{name}: {chance.choice(['|', '>', '|-'])}\n  {text}")
        elif style == 4:
            lines.append(f"{name}: {chance.choice(['!!str ', '!!float ', '!x ', '- ', '? '])}{text}")
        elif style == 5:
            lines.append(f"{name}:\n" + "".join(f"{chance.choice(['- ', '  - '])}{part}\n" for part in text.split(",")))
        elif style == 6:
            lines.append(chance.choice([f"{name}:{text}", f"{name} {text}", f"{name}: \"{text}\"", f"{name}: '{text}'", f"{{{name}: {text}}}", f"{name} : {text} # end"]))
        else:
            lines.append(f"{name}: {text}")
    return "\n".join(lines) + "\n"


def plain(chance, scene):
    lines = []
    for name, text in scene:
        lines.append(chance.choice(["-{} {}", "-{} {}", "-{} {}", "-{}\t{}", "  -{}   {}  ", "{} {}", "-{}={}", "-{} \"{}\"", "-{} {} # end", "--{} {}", "-{}"]).format(name, text))
        if chance.random() < 0.03:
            lines.append(chance.choice(["-prefix_push a_", "-prefix_pop", "-prefix_push", "# x", "-options_file x", "-prefix_push " + "p" * 600]))
    return "\n".join(lines) + "\n"


def csv(chance):
    rows = [line.split(",") for line in CSV.splitlines()]
    for _ in range(chance.choice([1, 1, 2, 5, 20])):
        what, row = chance.randrange(7), chance.choice(rows)
        at = chance.randrange(len(row)) if row else 0
        if what == 0 and row:
            row[at] = value(chance)
        elif what == 1 and row:
            del row[at]
        elif what == 2:
            row.insert(at, chance.choice(COLUMNS + ["y", "", "1"]))
        elif what == 3:
            rows.insert(chance.randrange(len(rows)), list(row))
        elif what == 4:
            rows.append([f"{chance.uniform(-0.6, 0.6):.3g}" for _ in range(chance.choice([3, 6, 6, 6]))])
        elif what == 5 and row:
            row[at] = misspelt(chance, row[at])
        elif len(rows) > 1:
            rows.remove(row)
    return "\n".join(",".join(row) for row in rows) + "\n"


def spoil(chance, content):
    """Mostly nothing; else done to the bytes: cut, flipped, other ends of lines, encodings, repetition."""
    pick = chance.randrange(24)
    if pick == 0:
        return content[:chance.randrange(len(content) + 1)]
    if pick == 1 and content:
        changed = bytearray(content)
        for _ in range(chance.choice([1, 3, 20])):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
        return bytes(changed)
    if pick < 8:
        return [content.replace(b"\n", b"\r\n"), content.replace(b"\n", b"\r"), content.rstrip(b"\n"), b"\xef\xbb\xbf" + content, content.decode("utf-8", "replace").encode("utf-16"),
                content * chance.choice([2, 50])][pick - 2]
    if pick == 8:
        at = chance.randrange(len(content) + 1)
        return content[:at] + chance.choice([bytes(chance.randrange(256) for _ in range(50)), b"\0", b"\t", b"\n\n", b"#", b"a" * 100000, b"," * 3000, b"{" * 50, b"\x1a"]) + content[at:]
    return content


def encode(text):
    return text.encode("utf-8", "surrogateescape")


def one_value(chance, keys):
    """The good scene with one value that cannot be good: the message has to name the key and the value."""
    name = chance.choice([k for k in keys if not keys[k].startswith("a path")])
    text = chance.choice(["nan", "1e999", "0x10", "frei", "--1", "1.2.3", "9" * 400, "٣"])
    scene = dict(SCENE)
    scene[name] = text
    if chance.randrange(2):
        return Input("value", {"scene.yaml": encode("".join(f"{k}: {v}\n" for k, v in scene.items()))}, ["scene.yaml"], (f"-{name} ", text[:20]))
    return Input("value", {"a.opts": encode("".join(f"-{k} {v}\n" for k, v in scene.items()))}, ["-options_file", "a.opts"], (f"-{name} ", text[:20]))


def inputs(seed, count, keys):
    chance = random.Random(seed)
    yield from special()
    for _ in range(count):
        pick = chance.random()
        if pick < 0.1:
            yield one_value(chance, keys)
        elif pick < 0.45:
            yield Input("yaml", {"scene.yaml": spoil(chance, encode(yaml(chance, pairs(chance, keys))))}, ["scene.yaml"], ())
        elif pick < 0.65:
            yield Input("plain", {"a.opts": spoil(chance, encode(plain(chance, pairs(chance, keys))))}, chance.choice([["a.opts"], ["-options_file", "a.opts"]]), ())
        elif pick < 0.95:
            yield Input("csv", {"s.csv": spoil(chance, encode(csv(chance)))}, CSV_SCENE, ())
        else:
            words = [word for pair in pairs(chance, keys) for word in ("-" + pair[0], pair[1])]
            yield Input("arguments", {}, [word.replace("\0", "").replace("\t", " ").replace("\n", " ") or " " for word in words], ())


def special():
    """What chance would not find: sizes, depths, things that are no text."""
    good = "".join(f"{k}: {v}\n" for k, v in SCENE.items())
    scenes = [b"", b"\n", b" ", b"\0", b"\0" * 1000, b"#", b"---\n", b"...\n", b"{}", b"[]", b"null", b"~", b"- 1\n", b"\xff\xfe", b"%YAML 9.9\n---\n", b"%TAG ! !\n", bytes(range(256)) * 20,
              encode(good) + b"\0" + b"ts_dt: 3\n", encode(good).replace(b"\n", b"\r\n"), encode(good).rstrip(), encode(good) + b"---\n" + encode(good), encode(good) * 20]
    for depth in (10, 100, 1000, 10000, 100000):
        scenes += [b"[" * depth + b"]" * depth, b"a: " + b"[" * depth, b"{a: " * depth + b"1" + b"}" * depth, b"- " * depth, b"".join(b" " * k + b"a:\n" for k in range(min(depth, 2000)))]
    laughs = "a0: &a0 1\n" + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 9))
    scenes += [encode(laughs), b"a: &a *a\n", b"a: &a [*a]\n", b"a: *b\n", b"<<: {ts_dt: 1}\n", b"? a\n: b\n", b"\tts_dt: 1\n", b"a" * 1000000 + b": 1\n", b"ts_dt: " + b"1" * 1000000,
               b"sphere_centers: " + b"0," * 500000 + b"0\n", b"sphere_centers: [" + b"0, " * 30000 + b"0]\n", b"x: 1\n" * 100000, b"".join(b"x%d: 1\n" % k for k in range(20000)), b"# " + b"c" * 3000000]
    for content in scenes:
        yield Input("yaml", {"scene.yaml": content}, ["scene.yaml"], ())
    options = [b"", b"\0", b"-", b"--", b"-\n-\n", b"-ts_dt", b"-ts_dt " + b"1" * 1000000, b"-" + b"a" * 1000000, b"-prefix_push a_\n" * 40 + b"-x 1\n" + b"-prefix_pop\n" * 40, b"-prefix_pop\n", b"-prefix_push\n",
               b"-x 1\n" * 100000, b"".join(b"-x%d 1\n" % k for k in range(20000)), b"-ts_dt \"0.1\n", b"-ts_dt \"\"\n", b'-ts_dt "0.1"\n', b"# only\n", bytes(range(256)) * 20, b"-ts_dt\t0.1\r\n", b"-help\n",
               b"-options_file a.opts\n", b"-log_view\n-bogus 1\n", b"-output_dir " + b"d" * 5000 + b"\n", b"-spheres_file " + b"d" * 5000 + b"\n", b"-restart " + b"d" * 4030 + b"\n"]
    for content in options:
        yield Input("plain", {"a.opts": content}, ["a.opts"], ())
    head = b"x1,x2,x3\n"
    grid = b"".join(b"%d,%d,%d\n" % (k % 100, k // 100 % 100, k // 10000) for k in range(1000000))
    spheres = [b"", b"\0", b"\n" * 100000, head, head * 2, b"x1,x2,x3", b"x1;x2;x3\n0;0;0\n", b"x1\tx2\tx3\n0\t0\t0\n", head + b"0,0,0", head + b"0,0,0\r\n", head.replace(b"\n", b"\r") + b"0,0,0\r", b"\xef\xbb\xbf" + head + b"0,0,0\n",
               head + b"0,0,0\0\n0.3,0,0\n", head + b"0,0," + b"0" * 1000000 + b"\n", head + b"," * 1000000, b"," * 1000000, head + bytes(range(256)) * 100, head + b"\"0\",\"0\",\"0\"\n", (head + b"0,0,0\n").decode().encode("utf-16"),
               head + b"0,0,0\n" * 1000000, head + b"0.9,0,0\n" * 1000000, head + grid, head + b"1e308,0,0\n", head + b"0,0,1e-320\n", b"x1,x2,x3,radius\n0,0,0,1e-300\n", b"x1,x2,x3,radius\n0,0,0,1e300\n", b"#\n" * 1000000]
    for content in spheres:
        yield Input("csv", {"s.csv": content}, CSV_SCENE, ())
    for words in (["."], ["/dev/null"], ["-options_file", "/dev/null"], ["-spheres_file", "/dev/null"], ["-spheres_file", "."], ["-options_file", "."], ["-restart", "."], ["-restart", "/dev/null"], ["-restart", "/dev/zero"],
                  ["-box_size", "1e300,1e300,1e300", "-grid_resolution", "1e-299"], ["-box_size", "1e-300,1e-300,1e-300", "-grid_resolution", "1e300"], ["-grid_resolution", "1e300"], ["-grid_resolution", "1e-300"],
                  ["-grid_processes", "2147483647,2147483647,2147483647"], ["-grid_processes", "0,0,2147483647"], ["-sphere_radius", "1e300", "-sphere_centers", "0,0,0"], ["-ts_dt", "1e-300"], ["-ts_max_time", "1e300"],
                  ["-box_size", "1000,1000,1000", "-grid_resolution", "0.5"], ["-gravity", "1e308,1e308,1e308"], ["-wall_velocity_upper", "1e308,0,0"], ["-wall_velocity_upper", "0,0,1e308"], ["-fluid_viscosity", "1e-320"]):
        yield Input("arguments", {}, words, ())
