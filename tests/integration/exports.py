"""What the libraries show to the linker: what the public headers declare, all of it, and nothing else.

usage: exports.py include-directory libhhtdae.so libhhtscene.so [libhhtflexible.so]
"""

import os
import re
import sys

from common import check, run

include, libraries = sys.argv[1], sys.argv[2:]


def header(name):
    with open(os.path.join(include, "hhtdae", name + ".h")) as file:
        return re.sub(r"/\*.*?\*/", "", file.read(), flags=re.DOTALL)


def shown(library):
    names = [line.split(maxsplit=2)[2].strip() for line in run(["nm", "-DC", "--defined-only", library]).splitlines()]
    check(names, library + " shows nothing")
    return names


# The C interface: the two lists are the same.
external = re.findall(r"PETSC_EXTERN[^;]*;", header("hhtdae") + header("options"))
declared = set(re.findall(r"\b(TSHHT3\w+)\s*(?:\[\])?\s*(?:\([^;]*\))?;", "\n".join(external)))
check(len(declared) > 20, "the header declares only %s" % sorted(declared))
names = set(shown(libraries[0]))
difference = names ^ (declared | {"PetscDLLibraryRegister_hhtdae"})
check(not difference, "shown or declared, but not both: %s" % sorted(difference))
print("libhhtdae shows %d names" % len(names))

# Scenes: members of the classes with sources of their own, steps of the state; an enter() for everything that holds markers or elements
names = shown(libraries[1])
analyses = re.findall(r"^PetscErrorCode (\w+)\(", header("analyses"), flags=re.MULTILINE)
known = r"(hhtdae::Element )?hhtdae::((Scene|TimeFunction|Motion|Snapshot|Linearization)::|(step5?|%s)\()" % "|".join(analyses)
foreign = [name for name in names if not re.match(known, name)]
check(not foreign, "not declared in the headers: %s" % foreign)
added = {match.group(1) for match in (re.match(r"hhtdae::Element hhtdae::Scene::enter<hhtdae::(\w+)>", name) for name in names) if match}
elements = set()
for text in (header("joints"), header("forces")):
    for name, body in re.findall(r"^struct (\w+) \{(.*?)(?:^\}| \});", text, flags=re.DOTALL | re.MULTILINE):
        if re.search(r"^\s*(Marker|Element|Body)\b|struct Term|vector<Expression>", body, flags=re.MULTILINE):
            elements.add(name)
check(len(elements) > 35, "joints.h and forces.h declare only %s" % sorted(elements))
for name in analyses:
    check(any(shows.startswith("hhtdae::%s(" % name) for shows in names), "declared and not shown: " + name)
check(added == elements, "an element without Scene::add(), or the other way round: %s" % sorted(added ^ elements))
print("libhhtscene shows %d names, %d kinds of elements among them" % (len(names), len(added)))

# Flexible bodies: members of classes and functions that the header declares
if len(libraries) > 2:
    text = header("flexible") + header("modes")
    functions = set(re.findall(r"^PetscErrorCode (\w+)\(", text, flags=re.MULTILINE))
    classes = set(re.findall(r"^(?:class|struct) (\w+)", text, flags=re.MULTILINE))
    names = shown(libraries[2])
    foreign = [name for name in names
               if not (match := re.match(r"hhtdae::(\w+)(::|\()", name)) or match.group(1) not in (classes if match.group(2) == "::" else functions)]
    check(not foreign, "not declared in the header: %s" % foreign)
    missing = [name for name in functions if not any(shows.startswith("hhtdae::%s(" % name) for shows in names)]
    check(functions and not missing, "declared and not shown: %s" % missing)
    print("libhhtflexible shows %d names" % len(names))
