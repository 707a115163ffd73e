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

void watch(sigset_t signals, std::atomic<bool>& cancelled, int patienceMs) {
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
    try {
        std::thread(watch, signals, std::ref(cancelled), patienceMs).detach();
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
