"""The page of a run in a real browser without a screen: it reads its data, draws, plays, has plots, and says nothing on the console.

usage: page.py BIN DIRECTORY [PYTHON PACKAGES]
"""

import base64
import html
import json
import math
import os
import re
import shutil
import sys
import zlib

from common import check, run, skip

bin, directory = sys.argv[1], sys.argv[2]
browser = next((b for b in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if b), None)
if not browser:
    skip("no Chromium (Debian: chromium)")
shutil.rmtree(directory, ignore_errors=True)
os.makedirs(directory)


def page(program, *options):
    """The page that a program of examples/ writes"""
    file = os.path.abspath(os.path.join(directory, program + ".html"))
    run([os.path.join(bin, program), "-scene_page", file, *options])
    return file


def look(file, *settings, checks=()):
    """What the page finds when it tests itself; for checks of page_checks.js these go into a copy of it, in front of the data."""
    if checks:
        with open(file) as plain, open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "page_checks.js")) as more:
            program = "<script>const wantedChecks = %s;\n%s</script>\n" % (json.dumps(checks), more.read())
            text = plain.read().replace('<script id="scene"', program + '<script id="scene"', 1)
        file = file.replace(".html", "-checks.html")
        with open(file, "w") as out:
            out.write(text)
    arguments = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                 "--user-data-dir=" + os.path.join(os.path.abspath(directory), "profile"), "--window-size=1000,700", "--virtual-time-budget=60000"]
    dom = run([browser, *arguments, *settings, "--dump-dom", "file://" + file + "#selftest"], seconds=240)
    found = re.search(r'data-selftest="([^"]*)"', dom)
    check(found, "%s did not come to the end of its test: %s" % (file, re.findall(r'id="message"[^<]*<?', dom)))
    result = json.loads(html.unescape(found.group(1)))
    if checks:
        found = re.search(r'data-checks="([^"]*)"', dom)
        check(found, "%s did not come to the end of its checks" % file)
        result["checks"] = json.loads(html.unescape(found.group(1)))
        print(os.path.basename(file), result["checks"])
    return result


def lose_first_body(block, bodies):
    """A block of frames in which the first of these bodies, which have no modes, is at no finite place"""
    data = bytearray(zlib.decompress(base64.b64decode(block)))
    frames, tracks = int.from_bytes(data[:4], "little"), 7 * bodies
    codes = 4 + 8 * frames + 16 * tracks
    for plane in range(2):
        begin = codes + plane * frames * tracks
        data[begin:begin + 7 * frames] = bytes(7 * frames)
        if plane == 0:
            for track in range(7):
                data[begin + track * frames] = 1  # from 0 to -1, which is 65535
    return base64.b64encode(zlib.compress(bytes(data))).decode()


def expect(file, frames, bodies, channels, surfaces):
    result = look(file)
    print(os.path.basename(file), os.path.getsize(file), "bytes", result)
    check(result["errors"] == [], "errors on the console: %s" % result["errors"])
    for key, value in (("frames", frames), ("bodies", bodies), ("channels", channels), ("surfaces", surfaces), ("visible", bodies)):
        check(result[key] == value, "%s: %s %s, not %d" % (file, result[key], key, value))
    check(result["webgl"] and result["drawn"] > 500 and result["colours"] > 4, "nothing to be seen: %s" % result)
    check(result["played"], "it does not play")
    check(result["plots"] >= min(channels, 2) + 1, "%d plots" % result["plots"])
    return result


# The body of the page's test is the first one, the crank, which turns about the x axis through (0, 0.1, 0.12) at a distance of 0.04.
file = page("slidercrank3d")
result = expect(file, 501, 3, 3, 0)
for place in (result["first"], result["last"]):
    check(abs(place[0]) < 1e-4 and abs(math.hypot(place[1] - 0.1, place[2] - 0.12) - 0.04) < 1e-4, "the crank is at %s" % place)
check(result["first"][:3] != result["last"][:3], "the crank does not move")

# What its test of itself leaves open, page_checks.js
found = look(file, checks=("curves", "times", "touch", "keys", "follow", "notice"))["checks"]
check(found["curves"]["first"] < 5000 and found["curves"]["later"] == 10 and found["curves"]["peak"],
      "a plot of 1e5 samples is drawn anew for each picture, or not all of it: %s" % found["curves"])
check(found["times"] == ["2.000 / 2.000", "1.000 / 1.000 · 10⁻¹⁵", "1001.000 / 1001.000", "0.2500 / 0.2500"], "times: %s" % found["times"])
check(found["touch"] == [0, -1, -1], "a touch that is no click selects a body: %s" % found["touch"])
check(abs(found["keys"]["turned"] - 0.1) < 1e-6 and abs(found["keys"]["raised"] - 0.1) < 1e-6 and abs(found["keys"]["farther"]) < 1e-6, "keys: %s" % found["keys"])
check(not found["keys"]["inList"] and found["keys"]["elsewhere"], "keys: %s" % found["keys"])
check(found["follow"] == ["true,false", "false,true", "true,false"], "follow: %s" % found["follow"])
check("cut off" not in found["notice"], "a whole page that says: %s" % found["notice"])

# A flexible rod with stress; attachments are bodies, too. With another unit there is another scale.
flexible = page("flexcrank")
expect(flexible, 501, 5, 6, 1)
found = look(flexible, checks=("units",))["checks"]["units"]
check(found["apart"] < 0.1 and found["colours"] > 20, "the same stress in another unit has other colours: %s" % found)
check([text[:14] for text in found["legends"]] == ["von Mises, rod", "von Mises, rod"], "legends: %s" % found)
check(found["legends"][0].count("MPa") == 4 and found["legends"][1].replace("MPa", "").count("Pa") == 0, "legends: %s" % found)

# A whole finite-element body on a hub: its nodes move by themselves
if os.path.exists(os.path.join(bin, "spinbeam")):
    result = look(page("spinbeam", "-body", "full", "-end", "2"), checks=("deflection",))
    check([result[key] for key in ("frames", "bodies", "visible", "surfaces", "errors")] == [501, 4, 4, 1, []], "a whole body: %s" % result)
    found = result["checks"]["deflection"]
    check(found["places"] == 3 and found["symbols"] == 1 and found["worst"] < 0.05, "where deflections are scaled attachments come off the surface: %s" % found)
    check(result["drawn"] > 300 and result["colours"] > 100 and result["played"], "a whole body is not to be seen: %s" % result)

# A page whose writer was stopped within a block shows what is whole, and says so
with open(file) as whole:
    text = whole.read()
cut = file.replace(".html", "-cut.html")
with open(cut, "w") as out:
    out.write(text[:text.rindex('data-kind="frames"') + 1000])
result = look(cut, checks=("notice",))
check(result["frames"] == 384 and result["errors"] == [] and "cut off" in result["checks"]["notice"], "a page that was cut off: %s" % result)

# Without WebGL the plots are left, and it says both
result = look(cut, "--disable-gpu", "--disable-3d-apis", checks=("notice",))
check(not result["webgl"] and result["plots"] == 4, "without WebGL: %s" % result)
check("no WebGL" in result["checks"]["notice"] and "cut off" in result["checks"]["notice"], "without WebGL: %s" % result)

# A body that is nowhere, of a name that looks like a program: it is left out of the picture, and its name is text
text = re.sub(r'(<script type="application/octet-stream" data-kind="frames">)([^<]*)', lambda m: m.group(1) + lose_first_body(m.group(2), 3), text)
text = text.replace('"name":"crank"', '"name":"\\u003c/script\\u003e\\u003cimg src=x onerror=console.error(1)\\u003e"')
lost = file.replace(".html", "-lost.html")
with open(lost, "w") as out:
    out.write(text)
result = look(lost)
check(result["visible"] == 2 and result["errors"] == [] and result["frames"] == 501, "a page with a lost body: %s" % result)

# What a notebook shows of a run: the same page, in a frame of the notebook's own
if len(sys.argv) > 4:
    program = """
import sys
import hhtdae
scene = hhtdae.Scene(gravity=(0, 0, -9.81))
ball = scene.add("ball", hhtdae.PointMass(velocity=(1, 0, 3))).shape(hhtdae.Shape.sphere(0.1))
scene.channel("height", hhtdae.displacement(ball.marker(), "z"), "m")
with open(sys.argv[1], "w") as out:
    out.write(scene.solve(0.5, page=True).page()._repr_html_())
"""
    cell = os.path.join(os.path.abspath(directory), "cell.html")
    run([sys.argv[3], "-c", program, cell], PYTHONPATH=sys.argv[4])
    with open(cell) as text:
        frame = text.read()
    notebook = cell.replace("cell", "notebook")
    with open(notebook, "w") as out:
        out.write("""<!DOCTYPE html><title>a notebook</title><p>A cell</p>%s
<script>
const page = document.querySelector('iframe');
page.onload = async () => {
  const inside = page.contentWindow;
  while (inside.document.querySelectorAll('.plot').length < 1) await new Promise(done => setTimeout(done, 50));
  await inside.testSelf();
  document.documentElement.dataset.selftest = inside.document.documentElement.dataset.selftest;
};
</script>""" % frame)
    result = look(notebook)
    print("in a notebook", result)
    check([result[key] for key in ("frames", "bodies", "visible", "channels", "errors")] == [501, 1, 1, 1, []], "in a notebook: %s" % result)
    check(result["webgl"] and result["drawn"] > 100 and result["played"], "nothing to be seen in a notebook: %s" % result)
