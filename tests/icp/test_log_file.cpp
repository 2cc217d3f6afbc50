#include <gtest/gtest.h>
#include <mp2p_icp/LogRecord.h>
#include <mp2p_icp/errors.h>
#include <mp2p_icp/load_map.h>
#include <mrpt/io/CMemoryStream.h>
#include <mrpt/serialization/CArchive.h>
#include <zlib.h>

#include <filesystem>
#include <fstream>

#include "expect_problem.h"
#include "icp_test_tools.h"
#include "mutations.h"
#include "test_data.h"
#include "test_repetitions.h"

using namespace mp2p_icp;
using namespace mp2p_icp_test;

namespace
{
/// A file of these bytes, gone with the object.
class LogFile
{
 public:
    explicit LogFile(const std::string& bytes = "") { std::ofstream(path, std::ios::binary) << bytes; }
    ~LogFile()
    {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
    std::string bytes() const
    {
        std::ifstream in(path, std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    const std::string path = temp_path(".icplog");
};

LogRecord logged_run()
{
    const CPose3D truth = pose_deg(0.04, -0.03, 0.02, 5, -3, 4);
    const auto surface = wavy_surface(60, 1);
    Bench bench;
    bench.parameters.saveIterationDetails = true;
    Results result;
    LogRecord log;
    bench.icp.align(map_of(seen_from(truth, *surface)), map_of(surface), {}, bench.parameters, result,
                    std::nullopt, log);
    return log;
}

/// As gzip(1) would make it of the file.
std::string gzip_of(const std::string& bytes)
{
    const std::string path = temp_path(".gz");
    const gzFile file = gzopen(path.c_str(), "wb");
    gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(file);
    std::ifstream in(path, std::ios::binary);
    std::string out{std::istreambuf_iterator<char>(in), {}};
    std::filesystem::remove(path);
    return out;
}

void expect_refused(const std::string& bytes, const std::vector<std::string>& words)
{
    const LogFile file(bytes);
    auto all = words;
    all.push_back(file.path);
    expect_problem_with<DataError>(all, [&] { (void)LogRecord::load_from_file(file.path); });
}
}  // namespace

TEST(log_file, is_read_back)
{
    const LogRecord log = logged_run();
    const LogFile file;
    ASSERT_TRUE(log.save_to_file(file.path));
    const LogRecord again = LogRecord::load_from_file(file.path);
    EXPECT_EQ(again.pcLocal->size(), 60u);
    EXPECT_TRUE(same_bits(again.icpResult.optimal_tf.mean, log.icpResult.optimal_tf.mean));
    ASSERT_EQ(again.iterations.size(), log.iterations.size());
    EXPECT_EQ(again.iterations.back().cost, log.iterations.back().cost);
}

TEST(log_file, is_an_error_when_it_is_missing_empty_or_cannot_be_written)
{
    expect_problem_with<DataError>({"/nowhere/x.icplog", "no such file"},
                                   [] { (void)LogRecord::load_from_file("/nowhere/x.icplog"); });
    expect_refused("", {"empty"});
    EXPECT_FALSE(logged_run().save_to_file("/nowhere/x.icplog"));
}

TEST(log_file, of_something_else_is_refused_by_name)
{
    expect_refused("1 2 3\n4 5 6\n", {"expected an ICP log"});
    const LogFile file;
    const std::string map = file.path + ".mm";
    save_map(map_of(wavy_surface(10, 1)), map);
    expect_problem_with<DataError>({map, "expected an ICP log", "mp2p_icp::metric_map_t"},
                                   [&] { (void)LogRecord::load_from_file(map); });
    std::filesystem::remove(map);
}

TEST(log_file, of_the_original_is_recognized_and_refused)
{
    for (const char version : {char(0), char(1), char(2)})
        expect_refused("\x93mp2p_icp::LogRecord" + std::string(1, version) + std::string(50, '\7'),
                       {"a log of the original mp2p_icp", "version " + std::to_string(int(version))});
    expect_refused("\x93mp2p_icp::LogRecord\x80" + std::string(50, '\7'),
                   {"version 128", "older", "Log the run again"});
    expect_refused("\x93mp2p_icp::LogRecord\xff" + std::string(50, '\7'), {"version 255", "newer"});
}

TEST(log_file, tells_its_headline_without_the_rest)
{
    LogRecord log = logged_run();
    log.icpResult.verdict = Verdict::under_constrained, log.icpResult.quality = 0.375;
    const LogFile whole;
    ASSERT_TRUE(log.save_to_file(whole.path));
    const std::string bytes = whole.bytes(), compressed = gzip_of(bytes);
    for (const std::string& start : {bytes, bytes.substr(0, 200), compressed, compressed.substr(0, 300)})
    {
        const auto headline = read_log_headline(LogFile(start).path);
        EXPECT_EQ(headline.verdict, Verdict::under_constrained);
        EXPECT_EQ(headline.quality, 0.375);
    }
    const auto expect_no_headline = [](const std::string& other, const std::vector<std::string>& words)
    {
        const LogFile file(other);
        expect_problem_with<DataError>(words, [&] { (void)read_log_headline(file.path); });
    };
    expect_no_headline("", {"no MRPT archive"});
    expect_no_headline("1 2 3\n", {"expected an ICP log"});
    expect_no_headline("\x93mp2p_icp::LogRecord\x80" + std::string(50, '\7'), {"version 128", "older"});
    expect_no_headline("\x93mp2p_icp::LogRecord\x81" + std::string(50, '\7'), {"no such verdict"});
    expect_no_headline(bytes.substr(0, 45), {"truncated"});
    expect_problem_with<DataError>({"/nowhere/x.icplog", "no such file"},
                                   [] { (void)read_log_headline("/nowhere/x.icplog"); });
}

TEST(log_file, that_is_truncated_is_refused)
{
    const LogFile whole;
    ASSERT_TRUE(logged_run().save_to_file(whole.path));
    const std::string bytes = whole.bytes();
    for (const size_t length : {size_t(3), size_t(30), bytes.size() / 2, bytes.size() - 1})
        expect_refused(bytes.substr(0, length), {});
}

// ---- Hostile files ----------------------------------------------------------------------------------------

namespace
{
/// Ends with a record or a DataError. \return was it read?
bool survives(const std::string& bytes)
{
    const LogFile file(bytes);
    try
    {
        (void)LogRecord::load_from_file(file.path).pcLocal->contents_summary();
        return true;
    }
    catch (const DataError& e)
    {
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
        return false;
    }
}

/// All kinds of pairings, a prior, planes with fits, and layers that are no clouds of points of one kind.
LogRecord small_log()
{
    LogRecord log = logged_run();
    Pairings all;
    all.paired_pt2ln.emplace_back(), all.paired_pt2pl.emplace_back();
    all.paired_ln2ln.emplace_back(), all.paired_pl2pl.emplace_back();
    all.pt2pl_weights = {{1, 0.3}};
    log.iterationsDetails->begin()->second.pairings.push_back(all);
    log.prior.emplace();
    log.icpResult.unobservable.emplace_back();
    auto local = std::make_shared<metric_map_t>(*log.pcLocal);
    local->metadata["sensor"] = std::string("a");
    local->planes.emplace_back(mrpt::math::TPlane(0, 0, 1, -2), mrpt::math::TPoint3D(0, 0, 2));
    log.pcLocal = local;
    return log;
}

std::string bytes_of_file(const LogRecord& log)
{
    const LogFile file;
    EXPECT_TRUE(log.save_to_file(file.path));
    return file.bytes();
}

/// Of the bytes before compression: what is not compressed is read as well.
std::string archive_bytes(const LogRecord& log)
{
    mrpt::io::CMemoryStream stream;
    mrpt::serialization::archiveFrom(stream) << log;
    return {static_cast<const char*>(stream.getRawBufferData()), stream.getTotalBytesCount()};
}
}  // namespace

TEST(log_file, that_is_damaged_gives_an_error_or_a_record_and_no_crash)
{
    const LogRecord log = small_log();
    const std::string file = bytes_of_file(log), archive = archive_bytes(log);
    ASSERT_TRUE(survives(file));
    ASSERT_TRUE(survives(archive));
    const size_t count = repetitions(40, 500);
    size_t read = 0, refused = 0;
    for (size_t i = 0; i < count; i++)
    {
        SeededRandom random(1000 + i);
        (void)survives(mutated(file, random));
        (survives(mutated(archive, random)) ? read : refused)++;
    }
    EXPECT_GT(read, count / 50) << "the damage must be of both kinds, else the test tests nothing";
    EXPECT_GT(refused, count / 50);
}

TEST(log_file, that_is_cut_anywhere_is_refused)
{
    const std::string archive = archive_bytes(small_log());
    const size_t steps = repetitions(30, 1000);
    for (size_t i = 0; i < steps; i++)
        EXPECT_FALSE(survives(archive.substr(0, archive.size() * i / steps))) << "part " << i;
}

TEST(log_file, counts_that_would_claim_all_memory_are_refused)
{
    const std::string archive = archive_bytes(small_log());
    size_t refused = 0;
    for (const std::string& word : {std::string("CSimplePointsMap"), std::string("mp2p_icp::ICP")})
    {
        std::string bad = archive;
        bad.replace(bad.find(word) + word.size() + 1, 4, "\xff\xff\xff\xff");
        refused += survives(bad) ? 0 : 1;
    }
    EXPECT_EQ(refused, 2u);
}
