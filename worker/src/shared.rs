//! Whether this worker and its coordinator see the same folder: it was named here, and has what the Welcome tells of.
//!
//! Without it states travel over the connection. Next file to read: [`crate::transfer`].

use std::sync::Arc;
use std::time::Duration;

use starlings_pieces::{Folder, PieceName, PlaceName};
use starlings_proto::Welcome;

use crate::news::News;

/// How long a folder may take to answer before it counts as not shared: below the time of an attempt to connect, which waits for it.
const PATIENCE: Duration = Duration::from_secs(4);

/// The folder of the run, where both see it; and what to say of it.
pub(crate) async fn find(
    place: Option<&PlaceName>,
    welcome: &Welcome,
) -> (Option<Arc<Folder>>, Option<News>) {
    let (Some(place), Some(probe)) = (place, welcome.probe) else { return (None, None) };
    let (folder, name) = (Arc::new(place.of_run(&welcome.run_id)), place.to_string());
    let own = Arc::clone(&folder);
    let tried = tokio::task::spawn_blocking(move || probed(&own, &probe));
    let reason = match tokio::time::timeout(PATIENCE, tried).await {
        Ok(Ok(Ok(()))) => return (Some(folder), Some(News::Shares { place: name })),
        Ok(Ok(Err(reason))) => reason,
        Ok(Err(_)) | Err(_) => format!("it does not answer within {} s", PATIENCE.as_secs()),
    };
    (None, Some(News::DoesNotShare { place: name, reason }))
}

/// Reads the probe and writes it again: both have to work.
fn probed(folder: &Folder, probe: &PieceName) -> Result<(), String> {
    let bytes = folder.read(probe).map_err(|error| error.to_string())?;
    folder.put(probe, &bytes).map_err(|error| error.to_string())
}
