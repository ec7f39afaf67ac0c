"""Check that a build runs on the first x86-64 machines: no instruction of newer ones outside the kernels for AVX2.

`baseline_check.py BUILD` disassembles every object file of the engine and of the Python module in a build folder.

- Only files named `*_avx2.cpp` have newer instructions. The engine calls them where the machine has AVX2.
- Such a file defines no function under a name that other files may use too, since the linker keeps one of several
  inline functions of the same name. Each name has `avx2` in it, as its namespace or that of an argument.
- Such a file runs nothing when the program starts.
"""

import os
import platform
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

# Everything with a VEX or EVEX prefix begins with v, or with k for masks. Then SSE3 to SSE4.2, BMI and others.
NEWER = re.compile(
    r"""^(?: v(?!er[rw]\b)\w+ | k(?:mov|and|or|xor|not|add|shift|test|unpck)\w*
    | (?:addsub|hadd|hsub)p[sd] | lddqu | mov(?:ddup|shdup|sldup|be|ntdqa)
    | ph(?:add|sub)\w+ | pmaddubsw | pmulhrsw | pshufb | psign[bwd] | palignr | pabs[bwd]
    | p?blend\w+ | dpp[sd] | extractps | insertps | mpsadbw | packusdw | pcmp(?:eqq|gtq|[ei]str\w) | pextr[bdq]
    | pinsr[bdq] | p(?:max|min)(?:s[bd]|u[dw]) | pmov[sz]x\w+ | pmuldq | pmulld | ptest | round[sp][sd] | crc32\w*
    | popcnt\w* | lzcnt\w* | andn | bextr | bls(?:i|r|msk) | bzhi | mulx | pdep | pext | rorx | s[ah][lr]x
    )$""",
    re.VERBOSE,
)
FUNCTIONS = "TWVi"  # of the letters of nm: in the text, weak, or resolved when the program starts


def output(*command: str | Path) -> str:
    """Return what a command prints."""
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def newer_instructions(file: Path) -> dict[str, str]:
    """Return functions of an object file with instructions that the first x86-64 machines lack, and one of each."""
    found: dict[str, str] = {}
    function = ""
    for line in output("objdump", "--disassemble", "--no-show-raw-insn", "--demangle", file).splitlines():
        if line.endswith(">:"):
            function = line.split("<", 1)[1][:-2]
        elif "\t" in line:
            instruction = line.split("\t")[-1].split()
            if instruction and NEWER.match(instruction[0]):
                found.setdefault(function, instruction[0])
    return found


def shared_functions(file: Path) -> list[str]:
    """Return functions of an object file that other files can see, and whose names do not say `avx2`."""
    symbols = (line.split(maxsplit=1) for line in output("nm", "--demangle", "--defined-only", file).splitlines())
    named = (rest.split(" ", 1) for _, rest in symbols)
    return [name for letter, name in named if letter in FUNCTIONS and "avx2" not in name]


def faults(file: Path) -> list[str]:
    """Return in words why this object file of a build must not run on an old machine."""
    if not file.name.endswith("_avx2.cpp.o"):
        return [f"{file}: {name} has {found}" for name, found in newer_instructions(file).items()]
    told = [f"{file}: other files may call {name}" for name in shared_functions(file)]
    if re.search(r"\.(?:init_array|ctors)\b", output("objdump", "--section-headers", file)):
        told.append(f"{file}: runs code when the program starts")
    return told


def main() -> None:
    """Check the object files of a build folder."""
    if platform.machine() != "x86_64":
        print(f"The baseline is that of x86-64; this is {platform.machine()}: skipped.")
        return
    build = Path(sys.argv[1])
    files = sorted(file for folder in ("cpp", "python") for file in (build / folder).rglob("*.o"))
    kernels = [file for file in files if file.name.endswith("_avx2.cpp.o")]
    if not kernels or not any(newer_instructions(file) for file in kernels):
        sys.exit(f"{build} has no kernels for AVX2: nothing would be found")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        told = [fault for each in pool.map(faults, files) for fault in each]
    print(*told, sep="\n", end="\n" if told else "")
    if told:
        sys.exit("Instructions of newer machines may run on older ones.")
    print(f"{len(files)} files: newer instructions in {len(kernels)} of them only, which only newer machines run.")


if __name__ == "__main__":
    main()
