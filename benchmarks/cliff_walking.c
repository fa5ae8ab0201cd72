/* Cliff Walking's learner under Stochastic Q Bumpers as one plain loop: what a core can do.

   Tabular Q-learning with transition credit, alpha = 0.7, second-best overrides, escalation; 100
   times an assisted episode and a greedy unassisted one in each trial.

       cc -O3 -march=native cliff_walking.c -o cliff_walking -lm
       ./cliff_walking TRIALS SEED

   Prints: steps seconds assisted_mean unassisted_mean */

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { ROWS = 4, COLUMNS = 12, STATES = ROWS * COLUMNS, ACTIONS = 4 };
enum { START = 3 * COLUMNS, GOAL = STATES - 1, EPISODES = 100, DECAY = 90, LIMIT = 100 };

static const double ALPHA = 0.7, V_MIN = 0, P_MAX = 0.999, LAST_RATE = 0.02;

typedef struct {
    int next_state;
    int ends;
    double reward;
} Outcome;

typedef struct {
    uint64_t a, b, c, counter;
} Stream;

typedef struct {
    long steps;
    double assisted, unassisted;
} Totals;

static Outcome outcomes[STATES][ACTIONS];
static double expert[STATES][ACTIONS];

/* SFC64 by C. Doty-Humphrey (PractRand). */
static inline uint64_t next_word(Stream *stream) {
    uint64_t word = stream->a + stream->b + stream->counter++;
    stream->a = stream->b ^ (stream->b >> 11);
    stream->b = stream->c + (stream->c << 3);
    stream->c = ((stream->c << 24) | (stream->c >> 40)) + word;
    return word;
}

static inline double uniform(Stream *stream) { return (next_word(stream) >> 11) * 0x1p-53; }

static Stream seeded(uint64_t seed, uint64_t trial) {
    Stream stream = {seed, trial, 0, 1};
    for (int i = 0; i < 12; i++) next_word(&stream);
    return stream;
}

static inline double best_of(const double *values) {
    double best = values[0];
    for (int action = 1; action < ACTIONS; action++)
        if (values[action] > best) best = values[action];
    return best;
}

static inline double second_of(const double *values, double best) {
    double second = -INFINITY;
    for (int action = 0; action < ACTIONS; action++)
        if (values[action] < best && values[action] > second) second = values[action];
    return second > -INFINITY ? second : best;
}

/* One of the actions of that value, each as likely. */
static inline int pick(const double *values, double target, double tie) {
    int equal = 0, action = 0;
    for (int other = 0; other < ACTIONS; other++) equal += values[other] == target;
    for (int left = (int)(tie * equal); action < ACTIONS - 1; action++)
        if (values[action] == target && left-- == 0) break;
    return action;
}

static int clipped(int number, int size) {
    return number < 0 ? 0 : number < size ? number : size - 1;
}

static void build_task(void) {
    const int down[ACTIONS] = {-1, 0, 1, 0}, right[ACTIONS] = {0, 1, 0, -1};
    for (int state = 0; state < STATES; state++)
        for (int action = 0; action < ACTIONS; action++) {
            int row = clipped(state / COLUMNS + down[action], ROWS);
            int column = clipped(state % COLUMNS + right[action], COLUMNS);
            int cell = row * COLUMNS + column;
            if (cell == GOAL) outcomes[state][action] = (Outcome){cell, 1, 99};
            else if (cell > START) outcomes[state][action] = (Outcome){START, 0, -100};
            else outcomes[state][action] = (Outcome){cell, 0, -1};
        }
}

/* Value iteration: no path to the goal is longer than the number of states. */
static void solve(void) {
    for (int sweep = 0; sweep < STATES; sweep++)
        for (int state = 0; state < GOAL; state++)
            for (int action = 0; action < ACTIONS; action++) {
                Outcome outcome = outcomes[state][action];
                expert[state][action] = outcome.reward;
                if (!outcome.ends) expert[state][action] += best_of(expert[outcome.next_state]);
            }
}

static inline int assist(const double *values, int proposed, double earned, double coin,
                         double tie) {
    double steepness = 2 * (log(1 - P_MAX) - log(P_MAX));
    double start_value = best_of(expert[START]), room = ALPHA * (start_value - V_MIN);
    double best = best_of(values), second = second_of(values, best);
    if (values[proposed] >= second) return proposed;
    if (start_value - earned - second >= room) return pick(values, best, tie);
    double ratio = (start_value - earned - values[proposed]) / room;
    double probability = 1;
    if (ratio <= 0) probability = 0;
    else if (ratio < 1) probability = 1 / (1 + exp(steepness * (ratio - 0.5)));
    return coin < probability ? pick(values, second, tie) : proposed;
}

static inline void assisted_episode(double own[][ACTIONS], double rate, Stream *stream,
                                    Totals *totals) {
    double earned = 0;
    for (int state = START, length = 0; length < LIMIT; length++) {
        double explore = uniform(stream), choice = uniform(stream);
        double coin = uniform(stream), tie = uniform(stream);
        int proposed = (int)(choice * ACTIONS);
        if (explore >= rate) proposed = pick(own[state], best_of(own[state]), choice);
        Outcome outcome = outcomes[state][assist(expert[state], proposed, earned, coin, tie)];
        double future = outcome.ends ? 0 : best_of(own[outcome.next_state]);
        own[state][proposed] += rate * (outcome.reward + future - own[state][proposed]);
        earned += outcome.reward;
        totals->steps++;
        if (outcome.ends) break;
        state = outcome.next_state;
    }
    totals->assisted += earned;
}

static inline void greedy_episode(double own[][ACTIONS], Stream *stream, Totals *totals) {
    for (int state = START, length = 0; length < LIMIT; length++) {
        Outcome outcome = outcomes[state][pick(own[state], best_of(own[state]), uniform(stream))];
        totals->unassisted += outcome.reward;
        totals->steps++;
        if (outcome.ends) break;
        state = outcome.next_state;
    }
}

static void run_trial(Stream stream, Totals *totals) {
    double own[STATES][ACTIONS];
    memset(own, 0, sizeof own);
    for (int episode = 0; episode < EPISODES; episode++) {
        double progress = episode < DECAY ? (double)episode / DECAY : 1;
        assisted_episode(own, 1 + progress * (LAST_RATE - 1), &stream, totals);
        greedy_episode(own, &stream, totals);
    }
}

int main(int count, char **arguments) {
    if (count != 3) {
        fprintf(stderr, "usage: %s TRIALS SEED\n", arguments[0]);
        return 2;
    }
    long trials = atol(arguments[1]);
    uint64_t seed = strtoull(arguments[2], NULL, 10);
    Totals totals = {0, 0, 0};
    build_task();
    solve();
    clock_t begin = clock();
    for (long trial = 0; trial < trials; trial++) run_trial(seeded(seed, trial), &totals);
    double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    double episodes = (double)trials * EPISODES;
    printf("%ld %.6f %.4f %.4f\n", totals.steps, seconds, totals.assisted / episodes,
           totals.unassisted / episodes);
    return 0;
}
