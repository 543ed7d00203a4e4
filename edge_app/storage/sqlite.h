#pragma once
// RAII for SQLite's handles: a connection, a statement, a transaction. A connection keeps its first
// failure until it is asked for it; after a failure statements do nothing. So one check at the end
// covers many steps. One thread at a time.
// Changes go to a write-ahead log (NAME-wal, NAME-shm) or are unlogged. A rollback journal is never
// written and never believed: a journal next to a database was put there by others, and SQLite
// would delete the files that the journal names.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace alidade {

// Path of a file beside a database that SQLite did not leave there for this program; empty: there
// is none. foreign_file_text() makes it a line for the user.
[[nodiscard]] std::string foreign_file_beside(const std::string& database);
[[nodiscard]] std::string foreign_file_text(const std::string& file);

class SqliteDatabase {
 public:
  SqliteDatabase() = default;

  // Opens an existing file; with `create` makes one if there is none. True: opened; only the first
  // statement shows whether the file is a database. A statement waits at most 2 s for other
  // connections. False also if there is a foreign_file_beside() it.
  [[nodiscard]] bool open(const std::string& path, bool create);
  void close();
  [[nodiscard]] bool is_open() const { return handle_ != nullptr; }

  void execute(const std::string& sql);
  // The value of a `PRAGMA` or `SELECT` with one row and column. 0, or empty, if it fails.
  [[nodiscard]] std::int64_t number_of(const std::string& sql);
  [[nodiscard]] std::string text_of(const std::string& sql);
  // Texts and blobs longer than this are neither read nor written.
  void limit_length(int bytes);

  [[nodiscard]] bool failed() const { return failure_ != 0; }
  [[nodiscard]] int failure() const { return failure_; }  // SQLite's primary code
  // The text for the user.
  [[nodiscard]] std::string failure_text() const;
  void forget_failure() {
    failure_ = 0;
    foreign_file_.clear();
  }

 private:
  friend class SqliteStatement;
  friend class SqliteTransaction;
  struct Close {
    void operator()(sqlite3* handle) const;
  };
  void fail(int code);

  std::unique_ptr<sqlite3, Close> handle_;
  int failure_ = 0;
  int system_error_ = 0;  // errno
  std::string foreign_file_;
};

class SqliteStatement {
 public:
  SqliteStatement(SqliteDatabase* database, const char* sql);

  // Parameters are counted from 1.
  void bind(int at, double value);
  void bind(int at, std::int64_t value);
  void bind_null(int at);
  void bind_blob(int at, const std::uint8_t* bytes, std::size_t size);  // copied
  void bind_text(int at, std::string_view text);                        // copied

  // True: there is a row. False: at the end, or failed.
  [[nodiscard]] bool step();
  // Steps to the end, then resets.
  void run();
  void reset();

  // Columns are counted from 0. False: another type.
  [[nodiscard]] bool get(int column, double* value) const;
  [[nodiscard]] bool get(int column, std::int64_t* value) const;
  [[nodiscard]] bool get_blob(int column, std::vector<std::uint8_t>* bytes) const;
  [[nodiscard]] bool get_text(int column, std::string* text) const;
  [[nodiscard]] bool is_null(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* handle) const;
  };
  SqliteDatabase* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
};

// Rolls back at its end unless it was committed.
class SqliteTransaction {
 public:
  // for_writing: no other connection can write until the end. Else all reads are of one moment.
  SqliteTransaction(SqliteDatabase* database, bool for_writing);
  ~SqliteTransaction();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;

  // True: done, and on disk as `PRAGMA synchronous` demands.
  [[nodiscard]] bool commit();

 private:
  SqliteDatabase* database_;
};

}  // namespace alidade
