#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What tools/setup.sh installs is enough: a command is run where nothing else can be seen.

    check_setup.py [--mode MODE] COMMAND...   runs COMMAND as root in a view of this machine that has a minimal Debian (what
                                              debootstrap --variant=minbase installs), git, and what tools/setup.sh MODE
                                              installs (none: the default; program, --ci, ...), each with what it depends
                                              on; this repository and /tmp are the real ones. Exit code: the command's; 2
                                              where this machine allows no such view
    check_setup.py [--mode MODE] --list       the Debian packages that the view has
    check_setup.py --self-test                in the view a planted program and a planted Python module are not found, and
                                              what set-up installs is

The view is an overlay over /, in a mount namespace of its own: files of other packages are covered, and so is what no
package has in /usr/local, /opt, home directories, the directories of programs and those of Python modules. dpkg knows the
packages of the view alone, so that tools/setup.sh would install what is missing. Nothing outside the view changes."""

import argparse
import functools
import os
import re
import shutil
import stat
import subprocess
import sys
import tempfile
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DPKG = Path("/var/lib/dpkg")
# On top of packages that are essential or of priority required.
BARE = ("apt", "git")
PROGRAMS = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
# Where people and other installers put things beside Debian's.
EMPTIED = ("/usr/local", "/opt", "/home", "/root")
SWEPT = ("/usr/bin", "/usr/sbin", "/usr/games", "/usr/lib/python3/dist-packages")
# Over this directory of the namespace the layers and the view are mounted.
PLACE = "/media" if "/mnt" in map(str, ROOT.parents) else "/mnt"


class Refused(Exception):
    """No view can be made here."""


def read_status(text):
    """The installed packages of a dpkg status file, by name: (what it depends on, lists of alternatives; the names it
    provides; whether every Debian has it)."""
    packages = {}
    for stanza in re.split(r"\n\n+", text.strip()):
        fields = dict(re.findall(r"^([\w-]+): *(.*)$", stanza, re.M))
        if not fields.get("Status", "").endswith(" ok installed"):
            continue
        names = lambda part: [re.match(r"\s*([^\s:(]+)", name)[1] for name in part]
        parts = lambda key: [part for part in fields.get(key, "").split(",") if part.strip()]
        depends = [names(part.split("|")) for part in parts("Pre-Depends") + parts("Depends")]
        provides = names(parts("Provides"))
        needed = fields.get("Essential") == "yes" or fields.get("Priority") == "required"
        packages[fields["Package"]] = (depends, provides, needed)
    return packages


def closure(packages, wanted):
    """`wanted`, the packages that every Debian has, and what they depend on. Of alternatives the one that is wanted anyway,
    else the first that is here."""
    seen, ahead, open_choices = set(), [*wanted, *(name for name, (_, _, needed) in packages.items() if needed)], []
    while ahead or open_choices:
        if not ahead:
            choice = open_choices.pop(0)
            here = [name for name in choice if name in packages]
            here += sorted(name for name, (_, provides, _) in packages.items() if not set(choice).isdisjoint(provides))
            if here and seen.isdisjoint(here):
                ahead.append(here[0])
            continue
        name = ahead.pop()
        if name not in seen:
            seen.add(name)
            for choice in packages[name][0]:
                if len(choice) == 1 and choice[0] in packages:
                    ahead.append(choice[0])
                else:
                    open_choices.append(choice)
    return seen


@functools.lru_cache(maxsize=None)
def real(directory):
    return os.path.realpath(directory)


def canonical(path):
    """A path as the file system has it: /bin/sh is /usr/bin/sh, whatever sh itself links to."""
    return os.path.join(real(os.path.dirname(path)), os.path.basename(path))


def files_of(packages):
    """All paths of packages, directories among them."""
    out = set()
    for listing in (DPKG / "info").glob("*.list"):
        if listing.stem.split(":")[0] in packages:
            out.update(canonical(line) for line in listing.read_text(encoding="utf-8").splitlines() if line != "/.")
    return out


def covered(kept, hidden, swept):
    """The topmost paths that hold nothing of `kept`: those of `hidden`, and of `swept` what is no link to what is kept."""
    out = set()
    for path in [path for path in hidden - kept if path.startswith(("/usr/", "/etc/"))] + [
            path for path in swept if path not in kept and os.path.realpath(path) not in kept]:
        while (parent := os.path.dirname(path)) not in kept:
            path = parent
        out.add(path)
    return out


def make_parents(layer, path):
    """Directories over `path` in a layer, with the owner and mode that they have below."""
    for parent in reversed(Path(path).parents):
        there = Path(layer + str(parent))
        if not there.is_dir():
            there.mkdir()
            below = os.stat(parent)
            os.chown(there, below.st_uid, below.st_gid)
            there.chmod(stat.S_IMODE(below.st_mode))


def mount(*words):
    done = subprocess.run(["mount", *words], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Refused(f"mount {' '.join(words)}: {done.stderr.strip()}")


def make_view(allowed, planted):
    """Mounts the view in this process's mount namespace; returns its directory. `planted`: path -> text of files that are
    there before anything is covered."""
    if len({os.stat(path).st_dev for path in ("/", "/usr", "/etc", "/var/lib/dpkg")}) != 1:
        raise Refused("/usr, /etc or /var/lib/dpkg is a file system of its own: expected all in that of /")
    mount("-t", "tmpfs", "wheelwright-setup", PLACE)
    upper, view = f"{PLACE}/upper", f"{PLACE}/view"
    for folder in (upper, view, f"{PLACE}/scratch"):
        os.mkdir(folder)
    installed = read_status((DPKG / "status").read_text(encoding="utf-8"))
    for path, text in planted.items():
        make_parents(upper, path)
        Path(upper + path).write_text(text, encoding="utf-8")
        os.chmod(upper + path, 0o755)
    if allowed is not None:
        swept = {os.path.join(folder, name) for folder in SWEPT if os.path.isdir(folder) for name in os.listdir(folder)}
        swept.update(path for path in planted if path.startswith(SWEPT))
        for path in covered(files_of(allowed), files_of(set(installed) - allowed), swept):
            make_parents(upper, path)
            if os.path.isdir(upper + path):
                shutil.rmtree(upper + path)
            elif os.path.lexists(upper + path):
                os.unlink(upper + path)
            os.mknod(upper + path, stat.S_IFCHR, 0)
        make_parents(upper, DPKG / "status")
        stanzas = (DPKG / "status").read_text(encoding="utf-8").strip().split("\n\n")
        known = [stanza + "\n" for stanza in stanzas if re.match(r"Package: (.*)", stanza)[1] in allowed]
        Path(f"{upper}{DPKG}/status").write_text("\n".join(known), encoding="utf-8")
    mount("-t", "overlay", "wheelwright-setup", "-o", f"lowerdir=/,upperdir={upper},workdir={PLACE}/scratch", view)
    mounted = [path for path in ("/etc/hosts", "/etc/resolv.conf") if os.path.ismount(path)]  # as containers have them
    for path in ("/proc", "/sys", "/dev", "/tmp", *mounted):
        mount("--rbind", path, view + path)
    if allowed is not None:
        for path in EMPTIED:
            if os.path.isdir(path):
                mount("-t", "tmpfs", "wheelwright-setup", view + path)
    os.makedirs(f"{view}{ROOT}", exist_ok=True)
    mount("--bind", str(ROOT), f"{view}{ROOT}")
    if allowed is not None:
        # Links of the alternatives to what is covered now.
        for group in sorted(os.listdir(DPKG / "alternatives")):
            link = f"{view}/etc/alternatives/{group}"
            if os.path.islink(link) and not os.path.exists(view + os.readlink(link)):
                subprocess.run(["chroot", view, "update-alternatives", "--quiet", "--auto", group], check=False,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        subprocess.run(["chroot", view, "ldconfig"], check=True)
    return view


def setup_packages(mode):
    listed = subprocess.run([ROOT / "tools/setup.sh", "--list", *mode], stdout=subprocess.PIPE, text=True, check=False)
    if listed.returncode != 0:
        raise Refused(f"tools/setup.sh --list {' '.join(mode)} failed")
    return [*BARE, *listed.stdout.split()]


def allowed_packages(mode):
    installed = read_status((DPKG / "status").read_text(encoding="utf-8"))
    wanted = setup_packages(mode)
    missing = [name for name in wanted if name not in installed]
    if missing:
        raise Refused(f"{', '.join(missing)} not installed: expected all that tools/setup.sh installs; run it")
    return closure(installed, wanted)


def enter(allowed, planted, command):
    """Runs `command` in a view, from a child in a mount namespace of its own; returns its exit code."""
    child = os.fork()
    if child == 0:
        try:
            os.chroot(make_view(allowed, planted))
            os.chdir(ROOT)
            os.execvpe(command[0], command, {"PATH": PROGRAMS, "HOME": "/root", "LANG": "C.UTF-8"})
        except (Refused, OSError) as error:
            print(f"check_setup: {error}", file=sys.stderr, flush=True)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(2)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def self_test():
    status = ("Package: a\nStatus: install ok installed\nDepends: b | c, v (>= 1), d:any\n\n"
              "Package: c\nStatus: install ok installed\nProvides: w\n\nPackage: d\nStatus: install ok installed\n\n"
              "Package: e\nStatus: deinstall ok config-files\nEssential: yes\n\n"
              "Package: f\nStatus: install ok installed\nEssential: yes\nPre-Depends: w\n\n"
              "Package: p\nStatus: install ok installed\nProvides: v (= 2), x\n\nPackage: q\nStatus: install ok installed\n")
    packages = read_status(status)
    assert set(packages) == set("acdfpq"), packages
    assert closure(packages, ["a"]) == set("acdfp"), closure(packages, ["a"])
    assert closure(packages, []) == {"f", "c"}, closure(packages, [])

    planted = {"/usr/bin/wheelwright-planted": "#!/bin/sh\n", "/usr/lib/python3/dist-packages/wheelwright_planted.py": "",
               "/usr/local/bin/wheelwright-planted-too": "#!/bin/sh\n"}
    allowed = allowed_packages([])
    others = files_of(set(read_status((DPKG / "status").read_text(encoding="utf-8"))) - allowed) - files_of(allowed)
    # Of packages that set-up does not install, as far as this machine has any.
    foreign = sorted(path for path in others if re.fullmatch(r"/usr/bin/[a-z]\w*", path) and os.path.isfile(path))[:3]
    modules = [path.split("/")[-2] for path in sorted(others)
               if re.fullmatch(r"/usr/lib/python3/dist-packages/[a-z]\w*/__init__[.]py", path)][:3]
    programs = [path.split("/")[-1] for path in planted if "/bin/" in path] + [path.split("/")[-1] for path in foreign]
    modules.append("wheelwright_planted")
    look = (f"for name in {' '.join(programs)} c++ git; do command -v $name >/dev/null && echo $name; done\n"
            f"for name in {' '.join(modules)} numpy; do /usr/bin/python3 -c \"import importlib.util, sys; "
            "sys.exit(importlib.util.find_spec('$name') is None)\" && echo $name; done\n"
            "dpkg-query -W -f='${Package}\\n' g++; exit 5\n")
    found = {}
    for name, packages in (("everything", None), ("the view", allowed)):
        with tempfile.TemporaryFile("w+") as output:
            saved = os.dup(1)
            os.dup2(output.fileno(), 1)
            code = enter(packages, planted, ["/bin/sh", "-c", look])
            os.dup2(saved, 1)
            os.close(saved)
            output.seek(0)
            found[name] = output.read().split()
        assert code == 5, (name, code, found)
    assert found["everything"] == [*programs, "c++", "git", *modules, "numpy", "g++"], found
    assert found["the view"] == ["c++", "git", "numpy", "g++"], found
    print("check_setup: self-test passed")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mode", default="", help="of tools/setup.sh")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("command", nargs=argparse.REMAINDER)
    arguments = parser.parse_args()
    mode = [arguments.mode] if arguments.mode else []
    try:
        if arguments.list:
            print("\n".join(sorted(allowed_packages(mode))))
            return 0
        if not (arguments.self_test or arguments.command):
            parser.error("expected a command")
        if os.geteuid() != 0:
            raise Refused("only root can hide what set-up does not install: expected to be run as root")
        if "WHEELWRIGHT_SETUP_NAMESPACE" not in os.environ:
            os.environ["WHEELWRIGHT_SETUP_NAMESPACE"] = "1"
            unshare = ["unshare", "--mount", "--propagation", "private"]
            probe = subprocess.run([*unshare, "true"], capture_output=True, text=True, check=False)
            if probe.returncode != 0:
                raise Refused(f"{probe.stderr.strip()}: expected a machine that lets root make a mount namespace")
            os.execvp("unshare", [*unshare, sys.executable, *sys.argv])
        if arguments.self_test:
            self_test()
            return 0
        return enter(allowed_packages(mode), {}, arguments.command)
    except Refused as error:
        print(f"check_setup: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
