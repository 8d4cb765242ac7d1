/* SPDX-License-Identifier: BSD-3-Clause */
/* Checks of the C tests.  CHECK(condition) counts; finish() prints the line that the tools read. */
#ifndef CHECKS_H
#define CHECKS_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "dynstep.h"

static int passed, failed;

#define CHECK(condition) note((condition) != 0, #condition, __LINE__)

/* A code, and a word that the message must have */
#define REFUSES(call, expected, word) note_refusal((call), expected, s, word, #call, __LINE__)

#define ADDRESS(x) ((intptr_t)(x))

static void note(int ok, const char *what, int line)
{
    if (ok) {
        passed++;
        return;
    }
    failed++;
    printf("FAIL line %d: %s\n", line, what);
}

static inline void note_refusal(int code, int expected, intptr_t s, const char *word, const char *what, int line)
{
    char text[DYNSTEP_MESSAGE_LENGTH];
    dynstep_message(s, sizeof text, text);
    int ok = code == expected && strstr(text, word) != NULL;
    note(ok, what, line);
    if (!ok) printf("     code %d (expected %d), message: %s (expected: ...%s...)\n", code, expected, text, word);
}

static int finish(void)
{
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0;
}

#endif
