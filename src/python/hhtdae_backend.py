"""Builds the wheel for pip (PEP 517) by CMake, from the source tree that contains this file; uses only the standard library.

    pip install ./src/python                       compiles in a temporary directory
    pip install --config-settings builddir=build ./src/python
                                                   in a build tree, which is kept, or takes what is compiled there already

The wheel holds the package and the libraries that it needs, in hhtdae/lib; PETSc and what belongs to it are those that petsc4py is for. Other settings become
variables of CMake: --config-settings PETSC_DIR=... . CMAKE_BUILD_PARALLEL_LEVEL in the environment says how many sources are compiled at a time.
"""

import base64
import contextlib
import hashlib
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
TREE = os.path.dirname(os.path.dirname(HERE))
NAME = "hhtdae"


def _version():
    with open(os.path.join(TREE, "CMakeLists.txt")) as file:
        return re.search(r"project\(hhtdae VERSION ([\d.]+)", file.read()).group(1)


def _environment():
    """The environment without the PYTHONPATH by which pip hides installed packages from builds: this build needs the installed petsc4py."""
    environment = dict(os.environ)
    if "pip-build-env" in environment.get("PYTHONPATH", ""):
        del environment["PYTHONPATH"]
    return environment


def _run(*command):
    done = subprocess.run(command, env=_environment(), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        raise SystemExit("%s\n%s" % (" ".join(command), done.stdout[-10000:]))
    return done.stdout


def _petsc():
    """Major and minor number of the petsc4py for which the modules are built"""
    out = _run(sys.executable, "-c", "import petsc4py; print(petsc4py.__version__)").split()[-1]
    major, minor = (int(x) for x in out.split(".")[:2])
    return "petsc4py>=%d.%d,<%d.%d" % (major, minor, major, minor + 1)


def _configure(build, settings):
    """Configures the build tree; an existing one is not configured again unless there are settings"""
    given = ["-D%s=%s" % (name, value) for name, value in settings.items() if name != "builddir"]
    if os.path.exists(os.path.join(build, "CMakeCache.txt")):
        if given:
            _run("cmake", "-S", TREE, "-B", build, *given)
        return
    said = _run("cmake", "-S", TREE, "-B", build, "-DHHTDAE_PYTHON=" + sys.executable, "-DHHTDAE_PROGRAMS=OFF", "-DBUILD_TESTING=OFF", *given)
    missing = [line for line in said.splitlines() if "the Python package is left out" in line]
    if missing:
        raise SystemExit("\n".join(missing))


@contextlib.contextmanager
def _installed(settings):
    """Builds, and installs to a directory; returns it"""
    if not os.path.exists(os.path.join(TREE, "CMakeLists.txt")):
        raise SystemExit("%s is no source tree of hhtdae: pip before 21.3 copies the directory that it builds" % TREE)
    with tempfile.TemporaryDirectory(prefix="hhtdae-") as folder:
        build = os.path.abspath(settings["builddir"]) if settings.get("builddir") else os.path.join(folder, "build")
        prefix = os.path.join(folder, "prefix")
        _configure(build, settings)
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL") or str(os.cpu_count() or 1)
        _run("cmake", "--build", build, "-j", jobs, "--target", "installed", "python")
        _run("cmake", "--install", build, "--prefix", prefix, "--strip")
        yield prefix


def _contents(prefix):
    """The contents of the wheel, as pairs (name in the wheel, file)"""
    package, = [folder for folder, _, files in os.walk(prefix) if os.path.basename(folder) == NAME and "__init__.py" in files]
    for name in sorted(os.listdir(package)):
        if os.path.isfile(os.path.join(package, name)):
            yield "%s/%s" % (NAME, name), os.path.join(package, name)
    for folder, _, files in os.walk(prefix):
        for name in sorted(files):
            if re.fullmatch(r"libhht\w+\.so\.\d+", name):  # the name for which the loader looks
                yield "%s/lib/%s" % (NAME, name), os.path.join(folder, name)


def _metadata():
    return ("Metadata-Version: 2.1\nName: %s\nVersion: %s\nSummary: Flexible multibody dynamics on PETSc: index-3 differential-algebraic equations by the "
            "Hilber-Hughes-Taylor method\nLicense: BSD-2-Clause\nRequires-Python: >=3.8\nRequires-Dist: numpy\nRequires-Dist: %s\n" % (NAME, _version(), _petsc()))


def _tag():
    abi = "cp%d%d" % sys.version_info[:2]
    return "%s-%s-%s" % (abi, abi, re.sub(r"[-.]", "_", sysconfig.get_platform()))


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """PEP 517's hook: returns the name of the wheel that it has made"""
    info, name = "%s-%s.dist-info" % (NAME, _version()), "%s-%s-%s.whl" % (NAME, _version(), _tag())
    record = []
    with _installed(config_settings or {}) as prefix, zipfile.ZipFile(os.path.join(wheel_directory, name), "w", zipfile.ZIP_DEFLATED) as wheel:

        def put(path, data, mode=0o644):
            entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
            entry.external_attr, entry.compress_type = (0o100000 | mode) << 16, zipfile.ZIP_DEFLATED
            wheel.writestr(entry, data)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record.append("%s,sha256=%s,%d" % (path, digest, len(data)))

        for path, file in _contents(prefix):
            with open(file, "rb") as source:
                put(path, source.read(), 0o755 if ".so" in path else 0o644)
        with open(os.path.join(TREE, "LICENSE"), "rb") as source:
            put(info + "/LICENSE", source.read())
        put(info + "/METADATA", _metadata().encode())
        put(info + "/WHEEL", ("Wheel-Version: 1.0\nGenerator: %s\nRoot-Is-Purelib: false\nTag: %s\n" % (NAME, _tag())).encode())
        wheel.writestr(info + "/RECORD", "\n".join(record + [info + "/RECORD,,", ""]))
    return name


def build_sdist(sdist_directory, config_settings=None):
    """PEP 517's hook"""
    raise SystemExit("the package is built from the source tree of hhtdae: pip install ./src/python, or pip wheel ./src/python")
