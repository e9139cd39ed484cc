"""Doxygen's input filter: a public header with its comments as documentation, and PETSc's manual pages at the declarations of their functions.

usage: filter.py header [directory with manual pages]

The comments of the headers are plain ones. A comment directly above a declaration and one behind it on its line become documentation of it; the first
one of a file is about the file; those in bodies of functions and those with a blank line behind stay what they are. Lines keep their numbers as far as
no manual page is put in.
"""

import glob
import os
import re
import sys
import textwrap

COMMENT = re.compile(r"/\*.*?\*/", re.S)
SPECIAL = re.compile(r"([\\@<>&#%*_|`$\[\]~])")


def prose(text):
    """A paragraph with nothing in it that Doxygen or Markdown would read as a command; text in backquotes as code, unless it is a name to link"""
    parts = re.split(r"(`[^`\n]*`)", text)
    return "".join(code(p[1:-1]) if p.startswith("`") and len(p) > 1 else SPECIAL.sub(r"\\\1", p) for p in parts)


def code(text):
    if re.fullmatch(r"\w+(\(\))?", text):
        return text
    return "<code>" + SPECIAL.sub(r"\\\1", text) + "</code>"


def paragraphs(text):
    """Paragraphs; what is indented by two or more against the first line of the text stands as it is"""
    out, verbatim = [], []

    def flush():
        while verbatim and not verbatim[-1].strip():
            verbatim.pop()
        if verbatim:
            out.append("\\verbatim\n" + textwrap.dedent("\n".join(verbatim)) + "\n\\endverbatim")
            verbatim.clear()

    begun = True  # an indented block begins behind a blank line, or a colon
    for line in text.split("\n"):
        indented = len(line) - len(line.lstrip()) >= 2
        if line.strip() and indented and (verbatim or begun):
            verbatim.append(line)
        elif not line.strip() and verbatim:
            verbatim.append("")
        else:
            flush()
            out.append(prose(line.strip()))
            begun = not line.strip() or line.rstrip().endswith(":")
    flush()
    return "\n".join(out)


def comment_text(comment):
    """Without the stars, dedented"""
    inner = comment[2:-2]
    first, _, rest = inner.partition("\n")
    return (first.strip() + "\n" + textwrap.dedent(rest)).strip("\n")


# ---- manual pages ----

def items(lines):
    """(name, text) of a list as PETSc writes it, whose lines begin with + . -"""
    found = []
    for line in lines:
        match = re.match(r"^[+.\-]\s+(.+?)\s+-\s+(.*)", line)
        if match:
            found.append([match.group(1).strip(), match.group(2)])
        elif line.strip() and found:
            found[-1][1] += " " + line.strip()
    return found


HEADINGS = re.compile(r"^\s*(Input Parameters?|Output Parameters?|Options Database Keys?|Level|Notes?|References|Calling sequence of [^:]*|Example[^:]*):\s*(.*)$")


def manual_page(text):
    """Doxygen's words for a manual page: its name, and the text"""
    name, brief = re.match(r"\s*(\w+)\s+-\s+((?:.+\n)+)", text + "\n").groups()
    rest = text[text.index(brief.rstrip("\n")) + len(brief.rstrip("\n")):]
    out, see = ["\\brief " + prose(" ".join(brief.split())), ""], ""
    if ".seealso:" in rest:
        rest, see = rest.split(".seealso:")
    blocks, heading = [], ("", "")
    lines = []
    for line in rest.split("\n"):
        match = HEADINGS.match(line)
        if match:
            blocks.append((heading, lines))
            heading, lines = (match.group(1), match.group(2)), []
        else:
            lines.append(line)
    blocks.append((heading, lines))
    for (title, same_line), lines in blocks:
        if title.startswith(("Input", "Output")):
            way = "in" if title.startswith("Input") else "out"
            out += ["\\param[%s] %s %s" % (way, part, prose(t)) for n, t in items(lines) for part in n.split(",")]
        elif title == "Level":
            out += ["\\par Level", prose(same_line)] + ([paragraphs(textwrap.dedent("\n".join(lines)))] if "".join(lines).strip() else [])
        elif title.startswith(("Options", "Calling", "References")):
            out += ["", "\\par " + prose(title), paragraphs(textwrap.dedent("\n".join(x[1:] for x in lines if x.startswith("$"))))]
            for n, t in items(lines):
                out.append("- " + ("" if n == "*" else "<code>" + SPECIAL.sub(r"\\\1", n) + "</code>: ") + prose(t))
            out.append("")
        elif title:
            out += ["", "\\par " + title, paragraphs(textwrap.dedent(same_line + "\n".join(lines)).strip("\n")).replace("\n\n", "\n\n\\par\n")]
        else:
            out += [paragraphs(textwrap.dedent("\n".join(lines)).strip("\n"))]
    if see:
        out += ["", "\\see " + " ".join(see.replace("`", "").split())]
    return name, "/**\n" + "\n".join(out) + "\n*/"


def manual_pages(folder):
    """By name: the page, and the function's declaration with the names of its arguments"""
    pages = {}
    for file in sorted(glob.glob(os.path.join(folder, "**", "*.cpp"), recursive=True)):
        with open(file) as source:
            text = source.read()
        for match in re.finditer(r"/\*(?:@C?|MC)\n(.*?)(?:@|M)\*/\n((?:[^{;]*?\))?)", text, re.S):
            name, page = manual_page(match.group(1).rstrip("\n"))
            declaration = " ".join(match.group(2).split())
            pages[name] = page, declaration + ";" if re.search(r"\b%s\(" % name, declaration) else ""
    return pages


# ---- headers ----

CONTAINER = re.compile(r"\b(struct|class|union|enum|namespace)\b[^;()]*$|extern\s+\"C\"\s*$")


class Scanner:
    """Knows between comments whether code is that of a scope with members, or of a function's body"""

    def __init__(self):
        self.scopes, self.statement = [], ""

    def read(self, text):
        text = re.sub(r"\"(\\.|[^\"\\])*\"|'(\\.|[^'\\])'", lambda m: m.group() if m.group() == '"C"' else '""', re.sub(r"//[^\n]*", "", text))
        text = re.sub(r"^\s*#.*?(?<!\\)$", "", text, flags=re.M)
        for c in text:
            if c == "{":
                kind = CONTAINER.search(self.statement)
                self.scopes.append(kind.group(1) or "extern" if kind else "")
                self.statement = ""
            elif c == "}":
                if self.scopes:
                    self.scopes.pop()
                self.statement = ""
            elif c == ";":
                self.statement = ""
            else:
                self.statement += c

    def among_members(self):
        return all(self.scopes)


def with_documentation(text, pages):
    scanner, out, end, first = Scanner(), "", 0, True
    for match in COMMENT.finditer(text):
        piece = text[end:match.start()]
        scanner.read(piece)
        out += piece
        end = match.end()
        line, behind = out[out.rfind("\n") + 1:], text[end:]
        body = paragraphs(comment_text(match.group()))
        if first:
            out += "/** \\file\n" + body + "\n*/"
        elif re.match(r"/\*\s*-{3}", match.group()) or not scanner.among_members():
            out += match.group()
        elif not line.strip():
            declared = re.match(r"[ \t]*\n[ \t]*([^\s}#/]|#define)", behind) or re.match(r"[ \t]*[^\s]", behind)
            out += ("/** " + body + " */") if declared else match.group()
        elif re.search(r"\b(struct|class|enum)\b[^;]*\{.*$", line) and not re.search(r"^\s+\S+.*;\s*$", line.partition("{")[0]):
            indent = line[:len(line) - len(line.lstrip())]
            out = out[:len(out) - len(line)] + indent + "/** " + body + " */ " + line.lstrip()
        elif re.search(r"[;,]\s*$", line) or scanner.scopes[-1:] == ["enum"]:
            out += "/**< " + body + " */"
        else:
            out += match.group()
        first = False
    out += text[end:]
    for function, (page, declaration) in pages.items():
        if declaration:
            out = re.sub(r"^(/\*\*(?:(?!\*/).)*\*/\n)?PETSC_EXTERN[^;]*\b%s\([^;]*;" % function, lambda m: page + "\nPETSC_EXTERN " + declaration, out, flags=re.M)
        else:
            out = re.sub(r"^(#define %s\b)" % function, lambda m: page + "\n" + m.group(1), out, flags=re.M)
    return re.sub(r"\bPETSC_EXTERN ", "", out)


def main():
    name = sys.argv[1]
    with open(name) as file:
        text = file.read()
    pages = manual_pages(sys.argv[2]) if len(sys.argv) > 2 and os.path.basename(name) == "hhtdae.h" else {}
    sys.stdout.write(with_documentation(text, pages))


if __name__ == "__main__":
    main()
