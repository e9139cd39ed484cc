"""What `make install` gives: the package in an empty prefix, found by PYTHONPATH alone, shows PyInit functions and links no Python library. What pip gives:
a wheel that runs with the libraries in it.

Needs the environment variables HHTDAE_BUILD and HHTDAE_CMAKE, which CTest sets.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import unittest

BUILD, CMAKE = os.environ.get("HHTDAE_BUILD"), os.environ.get("HHTDAE_CMAKE", "cmake")


def run(*command, **environment):
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, cwd="/", env={**os.environ, **environment})
    if done.returncode:
        raise AssertionError("%s\n%s\n%s" % (" ".join(command), done.stdout, done.stderr))
    return done.stdout


@unittest.skipUnless(BUILD, "no build tree is given")
class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="python-install-", dir=BUILD)
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run(CMAKE, "--install", BUILD, "--prefix", cls.folder)
        found = [folder for folder, _, files in os.walk(cls.folder) if "__init__.py" in files]
        assert len(found) == 1, found
        cls.package = found[0]

    def test_it_runs_from_there(self):
        script = ("import hhtdae as h\n"
                  "s = h.Scene(gravity=(0, 0, -2))\n"
                  "b = s.add('b', h.PointMass())\n"
                  "s.channel('z', h.displacement(b.marker(), 'z'))\n"
                  "print(h.__file__, round(s.solve(1.)['z'][-1], 9))\n"
                  "print(all(line.split()[-1].startswith(%r) for line in open('/proc/self/maps') if 'libhht' in line))\n" % self.folder)
        where, z, own = run(sys.executable, "-c", script, PYTHONPATH=os.path.dirname(self.package)).split()
        self.assertTrue(where.startswith(self.package), where)
        self.assertEqual(float(z), -1.)
        self.assertEqual(own, "True", "the build tree's libraries were loaded")

    def test_what_modules_show_and_need(self):
        modules = [name for name in os.listdir(self.package) if ".so" in name]
        self.assertTrue(any(name.startswith("_core.") for name in modules))
        for name in modules:
            file = os.path.join(self.package, name)
            shown = [line.split()[2] for line in run("nm", "-D", "--defined-only", file).splitlines() if line.split()[1] == "T"]
            self.assertEqual(shown, ["PyInit_" + name.split(".")[0]])
            self.assertNotIn("libpython", run("readelf", "-d", file))
        for folder, _, files in os.walk(self.folder):
            for name in files:
                if name.startswith("libhht") and ".so" in name:
                    self.assertNotIn("python", run("readelf", "-d", os.path.join(folder, name)).lower().replace(self.folder.lower(), ""))


@unittest.skipUnless(BUILD, "no build tree is given")
class Wheel(unittest.TestCase):
    def test_pip_installs_what_it_needs(self):
        """pip without a network, from the source tree; what the build tree has compiled is not compiled again"""
        source = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "src", "python")
        if subprocess.run([sys.executable, "-m", "pip", "--version"], capture_output=True).returncode:
            self.skipTest("there is no pip for %s (Debian: python3-pip)" % sys.executable)
        with tempfile.TemporaryDirectory(prefix="wheel-", dir=BUILD) as folder:
            run(sys.executable, "-B", "-m", "pip", "install", "--no-index", "--no-deps", "--no-compile", "--target", folder, "--config-settings", "builddir=" + BUILD, source)
            script = ("import hhtdae as h, importlib.metadata as m\n"
                      "s = h.Scene(gravity=(0, 0, -2))\n"
                      "b = s.add('b', h.PointMass())\n"
                      "s.channel('z', h.displacement(b.marker(), 'z'))\n"
                      "print(h.__file__, round(s.solve(1.)['z'][-1], 9))\n"
                      "if %r: h.flexible\n"
                      "print(all(line.split()[-1].startswith(%r) for line in open('/proc/self/maps') if 'libhht' in line), m.requires('hhtdae')[-1])\n"
                      % (any(name.startswith("_flexible.") for name in os.listdir(os.path.join(folder, "hhtdae"))), os.path.join(folder, "hhtdae", "lib")))
            where, z, own, needs = run(sys.executable, "-c", script, PYTHONPATH=folder).split()
            self.assertTrue(where.startswith(folder), where)
            self.assertEqual(float(z), -1.)
            self.assertEqual(own, "True", "libraries from elsewhere were loaded")
            self.assertTrue(needs.startswith("petsc4py"), needs)


if __name__ == "__main__":
    unittest.main()
