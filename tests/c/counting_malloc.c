/* SPDX-License-Identifier: BSD-3-Clause */
/* A program's own malloc, which counts and passes the call on to glibc. */
#include <stdlib.h>

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t number, size_t size);
extern void *__libc_realloc(void *block, size_t size);

static long calls;

/* Calls of malloc, calloc and realloc so far */
long allocator_calls(void);

long allocator_calls(void)
{
    return calls;
}

void *malloc(size_t size)
{
    calls++;
    return __libc_malloc(size);
}

void *calloc(size_t number, size_t size)
{
    calls++;
    return __libc_calloc(number, size);
}

void *realloc(void *block, size_t size)
{
    calls++;
    return __libc_realloc(block, size);
}
