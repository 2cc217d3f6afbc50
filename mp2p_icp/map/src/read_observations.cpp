#include <mp2p_icp/errors.h>
#include <mp2p_icp/observation_points.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservationComment.h>
#include <mrpt/obs/CRawlog.h>

#include <algorithm>
#include <optional>

#include "archives.h"
#include "text_scan.h"

namespace mp2p_icp
{
namespace
{
using Object = mrpt::serialization::CSerializable::Ptr;

/** The entries that an object of the archive stands for, counted as MRPT's CRawlog does: a comment is none, a
 * CRawlog or CSimpleMap that was written as one object is many, everything else is one.
 */
std::vector<Object> entries_of(const Object& object)
{
    std::vector<Object> entries;
    if (!object || std::dynamic_pointer_cast<mrpt::obs::CObservationComment>(object)) return entries;
    if (const auto rawlog = std::dynamic_pointer_cast<mrpt::obs::CRawlog>(object))
        for (size_t i = 0; i < rawlog->size(); i++) entries.push_back(rawlog->getAsGeneric(i));
    else if (const auto map = std::dynamic_pointer_cast<mrpt::maps::CSimpleMap>(object))
        for (size_t i = 0; i < map->size(); i++) entries.push_back(std::get<1>(map->get(i)));
    else
        entries.push_back(object);
    return entries;
}

/// Null if the entry is no observation.
mrpt::obs::CSensoryFrame::Ptr as_frame(const Object& entry)
{
    if (const auto frame = std::dynamic_pointer_cast<mrpt::obs::CSensoryFrame>(entry)) return frame;
    const auto observation = std::dynamic_pointer_cast<mrpt::obs::CObservation>(entry);
    if (!observation) return nullptr;
    const auto frame = mrpt::obs::CSensoryFrame::Create();
    frame->insert(observation);
    return frame;
}

bool has_range_data(const Object& entry)
{
    const auto frame = as_frame(entry);
    return frame &&
           std::any_of(frame->begin(), frame->end(), [](const auto& o) { return o && has_points(*o); });
}

/// Where an entry was found: the byte at which its object starts, and its place among the entries of that
/// object.
struct EntryPlace
{
    uint64_t byte = 0;
    uint64_t among = 0;
};

/// Goes through the archive, to the wanted entry, or as far as a message about it needs.
class EntryFinder
{
 public:
    EntryFinder(std::string_view bytes, uint64_t wanted) : reader_(bytes), wanted_(wanted) {}

    EntryPlace find()
    {
        while (!reader_.at_end() && !after_)
        {
            const uint64_t byte = reader_.position();
            const auto entries = next_entries();
            if (!entries) break;
            for (size_t k = 0; k < entries->size() && !after_; k++, count_++)
                if (look_at((*entries)[k])) return {byte, k};
        }
        throw std::runtime_error(complaint());
    }

 private:
    /// Empty if the archive is damaged behind the wanted entry: then that is not what to complain about.
    std::optional<std::vector<Object>> next_entries()
    {
        try
        {
            return entries_of(reader_.read());
        }
        catch (const std::runtime_error& e)
        {
            if (count_ > wanted_) return {};
            throw std::runtime_error("after " + std::to_string(count_) + " entries, " + e.what());
        }
    }

    bool look_at(const Object& entry)
    {
        const bool has = has_range_data(entry);
        if (count_ == wanted_)
        {
            if (has) return true;
            class_of_wanted_ = entry ? entry->GetRuntimeClass()->className : "nothing";
        }
        else if (has && count_ < wanted_)
            before_ = count_;
        else if (has)
            after_ = count_;
        return false;
    }

    std::string complaint() const
    {
        const auto n = std::to_string(wanted_);
        if (count_ == 0) return "there are no entries in it";
        if (class_of_wanted_.empty())
            return "there is no entry " + n + ": it has " + std::to_string(count_) + " entries, 0 to " +
                   std::to_string(count_ - 1);
        std::string near;
        if (before_) near = "entry " + std::to_string(*before_) + " before";
        if (after_) near += (near.empty() ? "" : " and ") + ("entry " + std::to_string(*after_) + " after");
        return "entry " + n + " (" + class_of_wanted_ + ") holds no range data; " +
               (near.empty() ? "nor does any other entry" : "the nearest that do: " + near + " it");
    }

    ArchiveReader reader_;
    uint64_t wanted_, count_ = 0;
    std::optional<uint64_t> before_, after_;
    std::string class_of_wanted_;  ///< set when the wanted entry has been seen, and has no range data
};

Object read_entry(std::string_view bytes, const EntryPlace& place)
{
    const auto entries = entries_of(ArchiveReader(bytes, place.byte).read());
    if (place.among >= entries.size()) throw std::runtime_error("the archive has changed while it was read");
    return entries[place.among];
}

std::string to_words(const EntryPlace& p)
{
    return std::to_string(p.byte) + " " + std::to_string(p.among);
}

EntryPlace from_words(const std::string& text)
{
    std::vector<std::string_view> words;
    split_words(text, Separators::Blanks, words);
    return {parse_count(words.at(0)).value(), parse_count(words.at(1)).value()};
}
}  // namespace

mrpt::obs::CSensoryFrame::Ptr read_observations(const std::string& source, std::string_view bytes,
                                                uint64_t wanted)
{
    // The rehearsal reads all the entries before the wanted one, and uses its points; here only that entry is
    // read.
    const auto place = rehearse(source, bytes,
                                [&]
                                {
                                    const auto found = EntryFinder(bytes, wanted).find();
                                    const auto rehearsed = as_frame(read_entry(bytes, found));
                                    mrpt::maps::CSimplePointsMap points;
                                    for (const auto& o : *rehearsed)
                                        if (o) insert_observation_points(*o, points);
                                    return to_words(found);
                                });
    mrpt::obs::CSensoryFrame::Ptr frame;
    perform(source, [&] { frame = as_frame(read_entry(bytes, from_words(place))); });
    return frame;
}

}  // namespace mp2p_icp
