"""The documentation is made without a warning of Doxygen, and has what it is for. Skipped where Doxygen or MathJax is not installed.

usage: docs.py build-tree cmake
"""

import os
import re
import shutil
import sys

from common import check, run, skip

build, cmake = sys.argv[1:3]
if not shutil.which("doxygen") or not os.path.exists(os.path.join(build, "docs", "Doxyfile")):
    skip("doxygen or libjs-mathjax is not installed")
run([cmake, "--build", build, "--target", "docs"])
html = os.path.join(build, "docs", "html")
with open(os.path.join(build, "docs", "warnings.txt")) as file:
    warnings = file.read().strip()
check(not warnings, "Doxygen warns:\n" + warnings[:4000])


def page(name):
    with open(os.path.join(html, name)) as file:
        return re.sub(r"<[^>]*>", "", file.read())


for name, words in {"tutorial.html": ["scene.connect(", "PetscCall(scene.createTS(&amp;ts))", "FeModel.from_mesh("],
                    "theory.html": ["Newmark"], "words.html": ["GFORCE", "TSALPHA2", "ChLinkTSDA"],
                    "hhtdae_8h.html": ["TSHHT3SetAlpha", "-ts_hhtdae_alpha", "numerical damping", "weakly unstable"],
                    "structhhtdae_1_1Bushing.html": ["Six springs and dampers", "preload"]}.items():
    text = page(name)
    for word in words:
        check(word in text, "%s lacks %s" % (name, word))
with open(os.path.join(html, "theory.html")) as file:
    source = file.read()
check("mathjax/MathJax.js" in source and os.path.exists(os.path.join(html, "mathjax", "MathJax.js")), "MathJax does not lie beside the pages")
for name in os.listdir(html):
    if name.endswith(".html"):
        with open(os.path.join(html, name), errors="replace") as file:
            text = file.read()
        check(not re.search(r"<(script|link|img)[^>]*(src|href)=\"(https?:)?//", text), name + " needs a network")
        for image in re.findall(r"<img[^>]*src=\"([^\"]+)\"", text):
            check(os.path.exists(os.path.join(html, image)), "%s shows %s, which is not there" % (name, image))
print("%d pages" % sum(name.endswith(".html") for name in os.listdir(html)))
