/* A decay that is measured, y = a exp(-k t), with a fault at a run that is told in advance: the runs of all programs are counted
 * in one file, so that the moment is the same on every machine. Reads params.txt, writes result.csv, as a solver through files.
 * FAULT_DIR holds `count` and, where there is to be a fault, `plan`: its kind, the first and the last run that it meets. With
 * FAULT_PAUSE a run takes so many milliseconds more, in which its parameters stand in `running.` and the number of the process. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static const double END = 4.0, STEP = 0.125;

static const char *in_folder(const char *name) {
    static char path[4096];
    snprintf(path, sizeof path, "%s/%s", getenv("FAULT_DIR"), name);
    return path;
}

static long count(void) {
    long n = 0;
    int file = open(in_folder("count"), O_RDWR | O_CREAT, 0600);
    char text[32] = "";
    if (file < 0 || flock(file, LOCK_EX) != 0 || pread(file, text, sizeof text - 1, 0) < 0) {
        perror("count");
        exit(1);
    }
    n = atol(text) + 1;
    int length = snprintf(text, sizeof text, "%ld\n", n);
    if (pwrite(file, text, length, 0) != length) exit(1);
    close(file);
    return n;
}

/* Waits until a process is stopped, and lets it go on. */
static void wake(pid_t pid) {
    char path[64], state = 'R';
    snprintf(path, sizeof path, "/proc/%d/stat", pid);
    while (state != 'T') {
        FILE *stat = fopen(path, "r");
        if (!stat) _exit(0);
        if (fscanf(stat, "%*d %*s %c", &state) != 1) state = 'R';
        fclose(stat);
    }
    kill(pid, SIGCONT);
    _exit(0);
}

/* Puts a program that fails in the place of this one. */
static void replace(const char *own) {
    char beside[4096];
    snprintf(beside, sizeof beside, "%s.new", own);
    FILE *file = fopen(beside, "w");
    fprintf(file, "#!/bin/sh\necho 'this is another program: cannot read its mesh' >&2\nexit 9\n");
    fclose(file);
    chmod(beside, 0755);
    rename(beside, own);
}

/* Interrupts the command, whose number stands in a file that is there once it was started. */
static void interrupt(void) {
    FILE *file;
    int pid = 0;
    while (pid == 0) {
        file = fopen(in_folder("command"), "r");
        if (file && fscanf(file, "%d.", &pid) != 1) pid = 0;
        if (file) fclose(file);
    }
    kill(pid, SIGINT);
}

static void meet(const char *kind, const char *own) {
    char line[8192];
    if (strcmp(kind, "scratch") == 0) {
        char *folder = getcwd(NULL, 0);
        *strrchr(folder, '/') = 0;
        snprintf(line, sizeof line, "rm -rf '%s'", folder);
        if (system(line) != 0) exit(1);
    } else if (strcmp(kind, "full") == 0) {
        if (symlink("/dev/full", "result.csv") != 0) exit(1);
    } else if (strcmp(kind, "licence") == 0) {
        fprintf(stderr, "licence server refused: no free seat\n");
        exit(3);
    } else if (strcmp(kind, "replaced") == 0) {
        replace(own);
    } else if (strcmp(kind, "removed") == 0) {
        unlink(own);
    } else if (strcmp(kind, "killed") == 0) {
        raise(SIGKILL);
    } else if (strcmp(kind, "stopped") == 0) {
        raise(SIGSTOP);
    } else if (strcmp(kind, "paused") == 0) {
        pid_t self = getpid();
        if (fork() == 0) wake(self);
        raise(SIGSTOP);
    } else if (strcmp(kind, "interrupt") == 0) {
        interrupt();
    } else if (strcmp(kind, "starlings-replaced") == 0) {
        replace(getenv("FAULT_STARLINGS"));
        kill(getppid(), SIGKILL);
    } else if (strcmp(kind, "worker-killed") == 0) {
        kill(getppid(), SIGKILL);
    } else if (strcmp(kind, "worker-stopped") == 0) {
        kill(getppid(), SIGSTOP);
    }
}

static void linger(double k, double a) {
    const char *pause = getenv("FAULT_PAUSE");
    char name[64], path[4096];
    if (!pause) return;
    snprintf(name, sizeof name, "running.%d", getpid());
    snprintf(path, sizeof path, "%s", in_folder(name));
    FILE *file = fopen(path, "w");
    if (!file || fprintf(file, "%.17g %.17g\n", k, a) < 0 || fclose(file) != 0) {
        perror(name);
        exit(1);
    }
    usleep(1000 * atoi(pause));
    unlink(path);
}

int main(int n_argument, char **arguments) {
    double k, a;
    long n = count(), first, last;
    char kind[64];
    FILE *plan = fopen(in_folder("plan"), "r");
    if (plan) {
        if (fscanf(plan, "%63s %ld %ld", kind, &first, &last) != 3) return 1;
        fclose(plan);
        if (first <= n && n <= last) meet(kind, n_argument > 0 ? arguments[0] : "");
    }
    FILE *in = fopen("params.txt", "r");
    if (!in || fscanf(in, "k %lf a %lf", &k, &a) != 2) {
        perror("params.txt");
        return 1;
    }
    fclose(in);
    linger(k, a);
    FILE *out = fopen("result.csv", "w");
    if (!out) {
        perror("result.csv");
        return 1;
    }
    fprintf(out, "time,y\n");
    for (double t = 0.0; t <= END; t += STEP) fprintf(out, "%.17g,%.17g\n", t, a * exp(-k * t));
    if (fclose(out) != 0) {
        perror("result.csv");
        return 1;
    }
    return 0;
}
