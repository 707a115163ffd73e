#include "tools/stop_signals.hpp"

#include <pthread.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <ctime>
#include <functional>
#include <system_error>
#include <thread>

#include "formats/files/temporaries.hpp"

namespace stx::tools {
namespace {

std::atomic<int> signalThatCame = 0;
std::atomic<bool> watching = false;

void watch(sigset_t signals, std::atomic<bool>& cancelled, int patienceMs) {
    watching = true;
    watching.notify_one();
    int signal = 0;
    while (sigwait(&signals, &signal) != 0) {
    }
    signalThatCame = signal;
    cancelled = true;
    // Some work (a decoder of a library, a kernel over a whole picture) looks seldom or never.
    // sigtimedwait also returns at once when the signal comes a second time.
    const timespec patience = {patienceMs / 1000, patienceMs % 1000 * 1'000'000L};
    while (sigtimedwait(&signals, nullptr, &patience) < 0 && errno == EINTR) {
    }
    removeOwnTemporaries();
    _exit(128 + signal);
}

}  // namespace

bool watchStopSignals(std::atomic<bool>& cancelled, int patienceMs) {
    struct sigaction action {};
    sigemptyset(&action.sa_mask);
    action.sa_handler = SIG_IGN;
    sigaction(SIGXFSZ, &action, nullptr);

    // Blocked in every thread, they wait for the one that takes them. A signal that the caller
    // ignores (nohup, a job in the background of a script) stays ignored.
    sigset_t signals;
    sigemptyset(&signals);
    for (const int signal : {SIGINT, SIGTERM}) {
        struct sigaction now {};
        sigaction(signal, nullptr, &now);
        if (now.sa_handler != SIG_IGN) sigaddset(&signals, signal);
    }
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    watching = false;
    try {
        std::thread(watch, signals, std::ref(cancelled), patienceMs).detach();
        // A thread that is still being made holds locks of the C library or of a sanitizer. A
        // fork() at that moment would leave them locked in the copy for good.
        watching.wait(false);
        return true;
    } catch (const std::system_error&) {
        pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
        return false;
    }
}

int stopSignal() {
    return signalThatCame;
}

}  // namespace stx::tools
