// Messages of the same lengths between the same ranks, time and again: persistent requests, and when they travelled.
#pragma once

#include <chrono>
#include <cstddef>
#include <exception>
#include <utility>
#include <vector>

#include "mpi/comm.hpp"

namespace breccia::mpi {

struct MessageLength {
  int rank = 0;
  std::size_t values = 0;
  friend bool operator==(const MessageLength&, const MessageLength&) = default;
};

/// When messages were on their way. Times are those at which this rank noticed.
struct Flights {
  using Clock = std::chrono::steady_clock;
  using Seconds = std::chrono::duration<double>;

  Seconds in_flight{0.0};    ///< from send() until everything expected was here, all rounds together
  Seconds waited{0.0};       ///< of that, doing nothing else
  std::uint64_t rounds = 0;  ///< in which anything was expected
  Clock::time_point sent{};  ///< of the last round
  Clock::time_point here{};  ///< of the last round
};

template <class T>
class PersistentMessages {
 public:
  explicit PersistentMessages(int tag) : tag_(tag) {}
  ~PersistentMessages() {
    // While an error unwinds, others may never send: better to leave the requests to the end of the program.
    if (expecting_ && std::uncaught_exceptions() > 0) return;
    if (travelling_) finish();
    if (expecting_) {
      for (MPI_Request& request : receives_) MPI_Cancel(&request);
      MPI_Waitall(static_cast<int>(receives_.size()), receives_.data(), MPI_STATUSES_IGNORE);
    }
    free();
  }
  PersistentMessages(const PersistentMessages&) = delete;
  PersistentMessages& operator=(const PersistentMessages&) = delete;

  void set(std::vector<MessageLength> to, std::vector<MessageLength> from, const Comm& comm) {
    if (to == to_ && from == from_) return;
    free();
    to_ = std::move(to);
    from_ = std::move(from);
    sent_.resize(total(to_));
    received_.resize(total(from_));
    T* at = received_.data();
    for (const MessageLength& m : from_) {
      receives_.emplace_back();
      MPI_Recv_init(at, static_cast<int>(m.values), datatype<T>(), m.rank, tag_, comm.handle(), &receives_.back());
      at += m.values;
    }
    at = sent_.data();
    for (const MessageLength& m : to_) {
      sends_.emplace_back();
      MPI_Send_init(at, static_cast<int>(m.values), datatype<T>(), m.rank, tag_, comm.handle(), &sends_.back());
      at += m.values;
    }
  }

  [[nodiscard]] std::vector<T>& sent() { return sent_; }
  [[nodiscard]] const std::vector<T>& sent() const { return sent_; }
  [[nodiscard]] const std::vector<T>& received() const { return received_; }
  [[nodiscard]] bool travelling() const { return travelling_; }
  [[nodiscard]] const Flights& flights() const { return flights_; }

  void expect() {
    if (expecting_) return;
    expecting_ = true;
    here_ = receives_.empty();
    if (!receives_.empty()) MPI_Startall(static_cast<int>(receives_.size()), receives_.data());
  }

  void send() {
    expect();
    travelling_ = true;
    flights_.sent = flights_.here = Flights::Clock::now();
    if (!sends_.empty()) MPI_Startall(static_cast<int>(sends_.size()), sends_.data());
  }

  [[nodiscard]] bool arrived() {
    if (here_) return true;
    int done = 0;
    MPI_Testall(static_cast<int>(receives_.size()), receives_.data(), &done, MPI_STATUSES_IGNORE);
    if (done != 0) all_here();
    return here_;
  }

  void finish() {
    if (!here_) {
      const auto begin = Flights::Clock::now();
      MPI_Waitall(static_cast<int>(receives_.size()), receives_.data(), MPI_STATUSES_IGNORE);
      all_here();
      flights_.waited += flights_.here - begin;
    }
    MPI_Waitall(static_cast<int>(sends_.size()), sends_.data(), MPI_STATUSES_IGNORE);
    travelling_ = expecting_ = false;
  }

 private:
  static std::size_t total(const std::vector<MessageLength>& messages) {
    std::size_t n = 0;
    for (const MessageLength& m : messages) n += m.values;
    return n;
  }

  void all_here() {
    here_ = true;
    flights_.here = Flights::Clock::now();
    flights_.in_flight += flights_.here - flights_.sent;
    ++flights_.rounds;
  }

  void free() {
    for (std::vector<MPI_Request>* requests : {&receives_, &sends_}) {
      for (MPI_Request& request : *requests) MPI_Request_free(&request);
      requests->clear();
    }
  }

  int tag_;
  std::vector<MessageLength> to_, from_;
  std::vector<T> sent_, received_;
  std::vector<MPI_Request> sends_, receives_;
  bool expecting_ = false;   // receives are started
  bool travelling_ = false;  // sends are started, too
  bool here_ = true;
  Flights flights_;
};

}  // namespace breccia::mpi
