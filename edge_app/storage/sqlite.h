#pragma once
// SQLite's handles, owned: a connection, a statement, a transaction. The first failure of a connection is kept until it is asked for, so
// that many steps can be taken and one question be asked at the end; after a failure statements do nothing. One thread at a time.
// Changes go to a write-ahead log (NAME-wal, NAME-shm) or unlogged: a rollback journal is never made, and none is believed. One that lies
// beside a database was put there, and SQLite would delete the files that it names.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace alidade {

// What lies beside a database, and is not what SQLite leaves there for this program; empty: nothing. What a user is told of it.
[[nodiscard]] std::string foreign_file_beside(const std::string& database);
[[nodiscard]] std::string foreign_file_text(const std::string& file);

class SqliteDatabase {
 public:
  SqliteDatabase() = default;

  // An existing file, or one that is made. True: opened; the file may be no database nevertheless, which the first statement shows.
  // False also where there is a foreign_file_beside() it.
  [[nodiscard]] bool open(const std::string& path, bool create);
  void close();
  [[nodiscard]] bool is_open() const { return handle_ != nullptr; }

  void execute(const std::string& sql);
  // Of a `PRAGMA` or `SELECT` with one row and column; 0 where it fails.
  [[nodiscard]] std::int64_t number_of(const std::string& sql);
  [[nodiscard]] std::string text_of(const std::string& sql);
  // No text or blob longer than this is read or written.
  void limit_length(int bytes);

  [[nodiscard]] bool failed() const { return failure_ != 0; }
  [[nodiscard]] int failure() const { return failure_; }  // SQLite's primary code
  // What a user is told of the failure.
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
  // To the end, and back to the beginning.
  void run();
  void reset();

  // Columns are counted from 0. False: of another type.
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

// Undone at the end unless it was committed.
class SqliteTransaction {
 public:
  // For writing: nobody else can write until its end. For reading: all of one moment.
  SqliteTransaction(SqliteDatabase* database, bool for_writing);
  ~SqliteTransaction();
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;

  // True: it is done, and on disk as `PRAGMA synchronous` has it.
  [[nodiscard]] bool commit();

 private:
  SqliteDatabase* database_;
};

}  // namespace alidade
