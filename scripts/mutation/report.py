"""What came out, for people and for programs."""
import json


def rows(verdicts):
    return [{"id": one.mutant.id, "room": one.mutant.room, "file": one.mutant.file, "breaks": one.mutant.breaks, "state": one.state,
             "by": one.by, "survives": one.mutant.survives, "cpu_s": round(one.cpu_s, 2), "runs": one.runs,
             "as_it_should": one.as_it_should} for one in verdicts]


def line(verdict):
    """One mutant on the screen."""
    word = {"killed": "killed", "timed out": "killed", "survived": "SURVIVED", "not compiled": "NOT COMPILED"}[verdict.state]
    if verdict.state == "survived" and verdict.mutant.survives:
        word = "survived"
    about = verdict.by if verdict.state != "survived" else verdict.mutant.survives or f"unexplained: {verdict.mutant.breaks}"
    if verdict.dead and verdict.mutant.survives:
        word, about = "KILLED", f"{about}, but the list explains why it survives"
    return f"{word:12} {verdict.mutant.room}/{verdict.mutant.id}: {about}"


def summary(verdicts):
    dead = sum(one.dead for one in verdicts)
    explained = sum(not one.dead and bool(one.mutant.survives) for one in verdicts)
    wrong = sum(not one.as_it_should for one in verdicts)
    cpu_s = sum(one.cpu_s for one in verdicts)
    return (f"{len(verdicts)} mutants: {dead} killed ({100 * dead / max(1, len(verdicts)):.0f} %), "
            f"{sum(one.state == 'survived' for one in verdicts)} survived ({explained} of them explained); "
            f"{wrong} not as they should; {cpu_s:.0f} s of CPU for the tests")


def markdown(verdicts):
    by_room = {}
    for one in verdicts:
        by_room.setdefault(one.mutant.room, []).append(one)
    text = ["| room | mutants | killed | of them timed out | survived, explained | survived | not compiled | CPU s |",
            "|---|---|---|---|---|---|---|---|"]
    for room, part in [*by_room.items(), ("all", verdicts)]:
        def count(*states, of=part):
            return sum(one.state in states for one in of)
        explained = sum(one.state == "survived" and bool(one.mutant.survives) for one in part)
        text.append(f"| {room} | {len(part)} | {count('killed', 'timed out')} | {count('timed out')} | {explained} | "
                    f"{count('survived') - explained} | {count('not compiled')} | {sum(one.cpu_s for one in part):.0f} |")
    alive = [one for one in verdicts if one.state == "survived"]
    if alive:
        text += ["", "| survivor | file | breaks | why it survives |", "|---|---|---|---|"]
        text += [f"| {one.mutant.id} | {one.mutant.file} | {one.mutant.breaks} | {one.mutant.survives or '**unexplained**'} |"
                 for one in alive]
    return "\n".join(text) + "\n"


def write(folder, verdicts):
    (folder / "report.json").write_text(json.dumps({"summary": summary(verdicts), "mutants": rows(verdicts)}, indent=1) + "\n")
    (folder / "report.md").write_text(markdown(verdicts))
