"""Learner-aware bumpers a second time: plain Python, one object per mirror, from the equations."""

import itertools

from tests.reference_rules import logistic, one_of

RATES = (0.02, 0.1, 0.3, 0.6, 1.0)
BLURS = (0.0, 0.003, 0.03)
EPSILONS = (0.01, 0.03, 0.1, 0.25, 0.5, 0.75, 1.0)
PRIOR = {"transition": 0.98, "observant": 0.01, "interruption": 0.01}
WITHIN, BETWEEN, CHANGE = 1e-3, 1e-6, 0.1
REMEMBERED = 10
LEARNS = 0.1


def close(gap, blur):
    return max(0.0, 1 - gap / (8 * blur)) ** 8


class Mirror:
    """A copy of a learner of one perception and one rate, with weights by (blur, epsilon)."""

    def __init__(self, perception, rate, task):
        self.perception, self.rate = perception, rate
        self.values = [[0.0] * task.actions for _ in range(task.states)]
        ways = list(itertools.product(BLURS, EPSILONS))
        self.weights = {way: PRIOR[perception] / len(RATES) / len(ways) for way in ways}

    def credited(self, proposed, executed):
        others = {"transition": proposed, "observant": executed, "interruption": None}
        return proposed if proposed == executed else others[self.perception]

    def learned(self, state, proposed, executed, target):
        """The row of a state after a step."""
        row, credited = list(self.values[state]), self.credited(proposed, executed)
        if credited is not None:
            row[credited] += self.rate * (target - row[credited])
        return row

    def means(self, state, action, blur, loss):
        row = self.values[state]
        near = [close(max(row) - v, blur * loss) if blur else float(v == max(row)) for v in row]
        return near[action] / sum(near)


class PlainLearnerAware:
    """Learner-aware bumpers that know the task."""

    def __init__(self, alpha, task, v_min=0.0):
        self.alpha, self.v_min, self.task = alpha, v_min, task
        self.mirrors = [Mirror(p, rate, task) for p in PRIOR for rate in RATES]
        self.new, self.loss = True, 0.0

    def outcomes(self, situation, action):
        """(probability, reward, next state or None at the end) of an action."""
        place = (situation.state, action)
        table = (self.task.probability, self.task.reward, self.task.next_state)
        rows = zip(*(part[place].tolist() for part in table), strict=True)
        ended = self.task.terminated[place]
        return [
            (p, r, None if end else to)
            for (p, r, to), end in zip(rows, ended.tolist(), strict=True)
            if p > 0
        ]

    def target(self, mirror, situation, action):
        return sum(
            p * (r + (0 if to is None else self.task.discount * max(mirror.values[to])))
            for p, r, to in self.outcomes(situation, action)
        )

    def back(self, situation, action):
        leading = [p for p, _, to in self.outcomes(situation, action) if to == situation.state]
        return float(sum(leading))

    def chances(self, state, proposed):
        """Joint probability of every mirror and way to choose, the proposal included."""
        found = {}
        for mirror, way in itertools.product(self.mirrors, itertools.product(BLURS, EPSILONS)):
            blur, epsilon = way
            meant = (1 - epsilon) * mirror.means(state, proposed, blur, self.loss)
            found[mirror, way] = mirror.weights[way] * (meant + epsilon / self.task.actions)
        total = sum(found.values())
        return {key: chance / total for key, chance in found.items()}

    def harm(self, situation, executed, shares):
        values, state = situation.values.tolist(), situation.state
        harms = [
            (max(values) - value) * (1 + 20 * self.back(situation, action))
            for action, value in enumerate(values)
        ]
        total = 0.0
        for mirror, share in shares.items():
            target = self.target(mirror, situation, executed)
            row = mirror.learned(state, situation.proposed, executed, target)
            near = [close(max(row) - value, BLURS[-1] * self.loss) for value in row]
            expected = sum(n * h for n, h in zip(near, harms, strict=True)) / sum(near)
            total += (share / mirror.rate * expected) if share >= 1e-3 else 0.0
        return total

    def help(self, situation, noise, lost, allowed, shares, learns):
        values, proposed = situation.values.tolist(), situation.proposed
        merits: list[float | None] = [None] * len(values)
        candidates = {a for a, v in enumerate(values) if v > values[proposed] and lost[a] < allowed}
        if learns and lost[proposed] < 0.5 * allowed:
            candidates.add(proposed)
        for action, value in enumerate(values):
            if action in candidates:
                credit = sum(
                    share * self.target(mirror, situation, action)
                    for mirror, share in shares.items()
                    if mirror.perception == "transition"
                )
                merits[action] = 0.1 * value - credit
        possible = [merit for merit in merits if merit is not None]
        if possible:
            return one_of(merits, max(possible), noise.tie)
        return one_of(values, max(values), noise.tie)

    def decide(self, situation, noise):
        values, proposed = situation.values.tolist(), situation.proposed
        if values[proposed] == max(values):
            return proposed, 0.0
        self.loss = situation.start_value - self.v_min
        allowed = self.alpha * self.loss
        lost = [situation.start_value - situation.earned - situation.discount * v for v in values]
        chances = self.chances(situation.state, proposed)
        shares = dict.fromkeys(self.mirrors, 0.0)
        for (mirror, _), chance in chances.items():
            shares[mirror] += chance
        unnoticed = sum(share for m, share in shares.items() if m.perception == "transition")
        learns = sum(share * mirror.rate for mirror, share in shares.items()) >= LEARNS
        action = self.help(situation, noise, lost, allowed, shares, learns)
        if action == proposed:
            return proposed, 0.0
        worth = self.harm(situation, action, shares) - self.harm(situation, proposed, shares)
        if values[action] - values[proposed] < self.alpha * worth:
            return proposed, 0.0
        ratio = lost[proposed] / allowed if allowed else 1.0
        due = logistic(ratio, 0.999) if 0 < ratio < 1 else float(ratio >= 1)
        lenient = min(1.0, abs(1 - self.alpha**2)) if learns else 0.0
        passing = unnoticed * lenient * (1 - due)
        return (action if noise.coin < 1 - passing else proposed), 1 - passing

    def observe(self, step):
        if self.new:
            self.loss = max(step.values) - self.v_min
        chances = self.chances(step.state, step.proposed)
        before = {p: sum(self.held(m) for m in self.mirrors if m.perception == p) for p in PRIOR}
        learns = sum(m.rate * self.held(m) for m in self.mirrors) >= LEARNS
        for (mirror, way), chance in chances.items():
            mirror.weights[way] = chance
        if not learns:  # what an override is to the learner stays as likely as it was
            for perception in PRIOR:
                of_it = [m for m in self.mirrors if m.perception == perception]
                after = sum(self.held(m) for m in of_it)
                for mirror in of_it:
                    for way in mirror.weights:
                        mirror.weights[way] *= before[perception] / after
        self.drift()
        ended = step.events & 1
        targets = [
            step.reward + (0 if ended else self.task.discount * max(m.values[step.next_state]))
            for m in self.mirrors
        ]
        for mirror, target in zip(self.mirrors, targets, strict=True):
            mirror.values[step.state] = mirror.learned(
                step.state, step.proposed, step.executed, target
            )
        self.new = bool(step.events & (1 | 8 | 16))
        if self.new:
            self.change_rates()

    @staticmethod
    def held(mirror):
        return sum(mirror.weights.values())

    def drift(self):
        ways = len(BLURS) * len(EPSILONS)
        for perception in PRIOR:
            of_it = [m for m in self.mirrors if m.perception == perception]
            held = sum(self.held(m) for m in of_it)
            for mirror, way in itertools.product(of_it, itertools.product(BLURS, EPSILONS)):
                mirror.weights[way] = (
                    (1 - WITHIN - BETWEEN) * mirror.weights[way]
                    + WITHIN * held / len(RATES) / ways
                    + BETWEEN / len(self.mirrors) / ways
                )

    def change_rates(self):
        for perception in PRIOR:
            old = [m for m in self.mirrors if m.perception == perception]
            tables = [[list(row) for row in m.values] for m in old]
            weights = [dict(m.weights) for m in old]
            held = [sum(each.values()) for each in weights]
            for place, mirror in enumerate(old):
                neighbours = [n for n in (place - 1, place + 1) if 0 <= n < len(old)]
                arrive = dict.fromkeys(neighbours, CHANGE / 2)
                arrive[place] = 1 - CHANGE / 2 * len(neighbours)
                total = sum(arrive[n] * held[n] for n in arrive)
                for s, row in enumerate(mirror.values):
                    for a in range(len(row)):
                        row[a] = sum(arrive[n] * held[n] * tables[n][s][a] for n in arrive) / total
                for way in mirror.weights:
                    mirror.weights[way] = sum(arrive[n] * weights[n][way] for n in arrive)


class PlainModelFreeLearnerAware(PlainLearnerAware):
    """Learner-aware bumpers that know of the task what happened."""

    def __init__(self, alpha, task, v_min=0.0):
        super().__init__(alpha, task, v_min)
        self.happened = {}

    def outcomes(self, situation, action):
        last = self.happened.get((situation.state, action), [])[-REMEMBERED:]
        return [(1 / len(last), reward, to) for reward, to in last]

    def target(self, mirror, situation, action):
        if (situation.state, action) in self.happened:
            return super().target(mirror, situation, action)
        behind = max(situation.values) - max(mirror.values[situation.state])
        return situation.values[action] - self.task.discount * behind

    def back(self, situation, action):
        if (situation.state, action) in self.happened:
            return super().back(situation, action)
        return 0.5

    def observe(self, step):
        super().observe(step)
        to = None if step.events & 1 else step.next_state
        self.happened.setdefault((step.state, step.executed), []).append((step.reward, to))
