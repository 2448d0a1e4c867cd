/* What is said on the command line, and the loop over turns. */
#include "emulate.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

static bool counts;

void leave(int code)
{
    if (counts)
        dprintf(2, "emulate: %lu instructions\n", executed());
    _exit(code);
}

int main(int count, char **arguments, char **environment)
{
    arguments++, count--;
    if (count && !strcmp(*arguments, "--count")) {
        counts = true;
        arguments++, count--;
    }
    if (!count)
        die("say which program to run: [--count] PROGRAM ARGUMENTS...");
    start_machine();
    load(arguments, environment);
    start_threads();
    schedule();
}
